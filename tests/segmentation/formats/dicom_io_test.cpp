// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/dicom_io.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numeric>

#include "tests/segmentation/formats/dicom_files.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using namespace testing;
namespace fs = std::filesystem;

GreyImage volume(const Eigen::Matrix3d& direction = oblique()) {
  GreyImage image;
  image.grid.size = {6, 5, 10};
  image.grid.spacing_mm = {0.7, 0.8, 4};
  image.grid.origin_mm = {-10, 20, 30};
  image.grid.direction = direction;
  image.voxels.resize(300);
  std::iota(image.voxels.begin(), image.voxels.end(), 3.0f);
  return image;
}

class Dicom : public ::testing::Test {
 protected:
  std::string refusal(const std::string& wanted = "") {
    return message_of([&] { read_dicom(folder_.path(), wanted); });
  }
  void expect_refused(const std::string& because, const std::string& wanted = "") {
    const std::string message = refusal(wanted);
    EXPECT_NE(message.find(because), std::string::npos) << message;
  }
  TemporaryFolder folder_;
};

TEST_F(Dicom, SeriesComesBackWithItsPlaceAndRescaledGreys) {
  const GreyImage image = volume();
  write_dicom_series(folder_.path(), image);
  write_text(folder_ / "README.txt", "not an image");
  const DicomVolume read = read_dicom(folder_.path(), "");
  EXPECT_EQ(read.file.frame, "LPS");
  EXPECT_EQ(read.series.patient_position, "FFP");
  const Grid& grid = read.file.image.grid;
  ASSERT_EQ(grid.size, image.grid.size);
  EXPECT_LT((grid.spacing_mm - image.grid.spacing_mm).norm(), 1e-5);
  EXPECT_LT((grid.origin_mm - image.grid.origin_mm).norm(), 1e-5);
  EXPECT_LT((grid.direction - image.grid.direction).norm(), 1e-5);
  for (std::size_t n = 0; n < image.voxels.size(); ++n) ASSERT_EQ(read.file.image.voxels[n], 2 * image.voxels[n] - 5);
}

TEST_F(Dicom, ChoosesASeriesByNumberDescriptionOrUid) {
  const GreyImage image = volume(Eigen::Matrix3d::Identity());
  write_dicom_series(folder_.path(), image);
  write_dicom_series(folder_.path(), image, {"1.2.3.5", "12", "dynamic", "FFP", ""});
  EXPECT_EQ(list_dicom_series(folder_.path()).size(), 2u);
  expect_refused("holds 2 series; choose one");
  expect_refused("number 12, \"dynamic\", MR, 10 files, 1.2.3.5");
  expect_refused("holds no series \"t2\"", "t2");
  for (const char* wanted : {"12", "dynamic", "1.2.3.5"})
    EXPECT_EQ(read_dicom(folder_.path(), wanted).series.uid, "1.2.3.5");
}

TEST_F(Dicom, FoldersInsideFoldersAreSearched) {
  const GreyImage image = volume(Eigen::Matrix3d::Identity());
  const fs::path study = folder_.path() / "patient" / "study";
  for (const char* series : {"s1", "s2"}) fs::create_directories(study / series);
  write_dicom_series(study / "s1", image);
  write_dicom_series(study / "s2", image, {"1.2.3.5", "12", "dynamic", "FFP", ""});
  EXPECT_EQ(list_dicom_series(folder_.path()).size(), 2u);
  EXPECT_EQ(read_dicom(folder_.path(), "12").file.image.grid.size, image.grid.size);
  EXPECT_NE(refusal().find("holds 2 series"), std::string::npos);
}

TEST_F(Dicom, RefusesAMissingSlice) {
  write_dicom_series(folder_.path(), volume());
  fs::remove(folder_ / "7_005.dcm");  // (7 k) mod 10 = 5: slice 5
  expect_refused("a slice is missing");
  expect_refused("it is 8.00 mm, elsewhere 4.00");
}

TEST_F(Dicom, RefusesUnevenSpacing) {
  const GreyImage image = volume();
  for (int k = 0; k < 10; ++k)
    write_dicom_slice(folder_ / fmt::format("{}", k), image, k, {}, (k > 4 ? 0.3 : 0) * image.grid.direction.col(2));
  expect_refused("uneven slice spacing: 4.300 mm");
}

TEST_F(Dicom, RefusesGantryTilt) {
  const GreyImage image = volume();
  for (int k = 0; k < 10; ++k)
    write_dicom_slice(folder_ / fmt::format("{}", k), image, k, {}, 0.5 * k * image.grid.direction.col(1));
  expect_refused("gantry tilt: the stack leans 7.1");
}

TEST_F(Dicom, RefusesFourDimensions) {
  write_dicom_series(folder_.path(), volume());
  write_dicom_slice(folder_ / "again", volume(), 4);
  expect_refused("(4-D)");
}

TEST_F(Dicom, RefusesColourAndFrames) {
  write_dicom_slice(folder_ / "a", volume(), 0, {"1.2", "1", "", "", "", "", 3, 1});
  expect_refused("colour (3 samples per pixel)");
  write_dicom_slice(folder_ / "a", volume(), 0, {"1.2", "1", "", "", "", "", 1, 2});
  expect_refused("2 frames in one file");
}

TEST_F(Dicom, RefusesSlicesThatDoNotBelongTogether) {
  write_dicom_series(folder_.path(), volume());
  GreyImage other = volume();
  other.grid.size.x() = 5;
  other.voxels.resize(250);
  write_dicom_slice(folder_ / "z", other, 9);
  expect_refused("size 5 x 5 against 6 x 5");
  write_dicom_slice(folder_ / "z", volume(Eigen::Matrix3d::Identity()), 9);
  expect_refused("another orientation");
  other = volume();
  other.grid.spacing_mm.x() = 0.9;
  write_dicom_slice(folder_ / "z", other, 9);
  expect_refused("another pixel spacing");
  SeriesHeader header;
  header.frame_of_reference = "9.9";
  write_dicom_slice(folder_ / "z", volume(), 9, header);
  expect_refused("another frame of reference");
}

TEST_F(Dicom, RefusesOneSliceAnEmptyVolumeAndFoldersWithoutImages) {
  expect_refused("no DICOM image");
  write_dicom_slice(folder_ / "a", volume(), 0);
  expect_refused("one slice only");
  GreyImage image = volume();
  image.voxels.assign(300, 0.0f);
  write_dicom_series(folder_.path(), image);
  fs::remove(folder_ / "a");
  expect_refused("every voxel is -5");
  EXPECT_NE(message_of([&] { read_dicom(folder_ / "nowhere", ""); }).find("cannot be read"), std::string::npos);
}

TEST_F(Dicom, RefusesAFileThatIsCutShort) {
  write_dicom_series(folder_.path(), volume());
  fs::resize_file(folder_ / "7_003.dcm", fs::file_size(folder_ / "7_003.dcm") - 20);
  expect_refused("7_003.dcm: the file ends");
  expect_refused("cut short");
}

}  // namespace
}  // namespace supine::segmentation
