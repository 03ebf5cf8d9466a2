// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/image_io.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iterator>

#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using namespace testing;

constexpr double header_digits_mm = 1e-5;  // NIfTI keeps geometry in float

void expect_same(const GreyImage& read, const GreyImage& written) {
  ASSERT_EQ(read.grid.size, written.grid.size);
  EXPECT_EQ(read.voxels, written.voxels);
  EXPECT_NEAR((read.grid.spacing_mm - written.grid.spacing_mm).norm(), 0, header_digits_mm);
  const Eigen::Vector3d last = (written.grid.size - Eigen::Vector3i::Ones()).cast<double>();
  for (const auto& corner :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(last.x(), 0, 0), Eigen::Vector3d(0, last.y(), 0), last})
    EXPECT_NEAR((read.grid.point(corner) - written.grid.point(corner)).norm(), 0, header_digits_mm);
  EXPECT_NEAR((read.grid.direction.transpose() * read.grid.direction - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
}

/// Identity, one axis flipped (left-handed), two flipped, axes swapped, oblique, oblique and flipped.
std::vector<Eigen::Matrix3d> directions() {
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d swapped;
  swapped << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const Eigen::Vector3d one(1, 1, -1), two(-1, -1, 1);
  return {identity,  identity * one.asDiagonal(), identity * two.asDiagonal(), swapped,
          oblique(), oblique() * one.asDiagonal()};
}

TEST(ImageIo, EveryFormatKeepsVoxelsAndPlacesWhateverTheDirection) {
  const TemporaryFolder folder;
  for (const auto& direction : directions()) {
    const GreyImage image = numbered_image(direction);
    for (const std::string frame : {"LPS", "RAS"}) {
      write_nrrd(folder / "a.nrrd", image, frame);
      expect_same(read_image(folder / "a.nrrd", "").image, image);
      EXPECT_EQ(read_image(folder / "a.nrrd", "LPS").frame, frame);
      write_meta_image(folder / "a.mha", image, frame);
      expect_same(read_image(folder / "a.mha", frame).image, image);  // names no frame: the case's
      write_vti(folder / "a.vti", image, frame);
      expect_same(read_image(folder / "a.vti", "").image, image);
    }
    for (const Form form : {Form::sform, Form::qform})
      for (const char* name : {"a.nii", "a.nii.gz"}) {
        write_nifti(folder / name, image, form);
        expect_same(read_image(folder / name, "").image, image);
        EXPECT_EQ(read_image(folder / name, "LPS").frame, "RAS");
      }
  }
}

TEST(ImageIo, NiftiWithoutFormsTakesTheCasesFrameAndSaysSo) {
  const TemporaryFolder folder;
  const GreyImage image = numbered_image();
  write_nifti(folder / "a.nii", image, Form::none);
  const ImageFile lps = read_image(folder / "a.nii", "LPS");
  ASSERT_EQ(lps.warnings.size(), 1u);
  EXPECT_EQ(lps.frame, "");
  EXPECT_NEAR((lps.image.grid.direction - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
  EXPECT_EQ(lps.image.grid.origin_mm, Eigen::Vector3d::Zero());
  const Eigen::Vector3d flipped(-1, -1, 1);
  EXPECT_NEAR((read_image(folder / "a.nii", "RAS").image.grid.direction - Eigen::Matrix3d(flipped.asDiagonal())).norm(),
              0, 1e-12);
  EXPECT_NE(message_of([&] { read_image(folder / "a.nii", ""); }).find("case.frame"), std::string::npos);
}

TEST(ImageIo, AVolumeThatDoesNotSayWhereItBeginsIsToldOf) {
  const TemporaryFolder folder;
  const GreyImage image = numbered_image();
  write_nrrd(folder / "a.nrrd", image);
  write_meta_image(folder / "a.mha", image);
  for (const auto& [file, key] : {std::pair<std::string, std::string>("a.nrrd", "space origin"), {"a.mha", "Offset"}}) {
    EXPECT_TRUE(read_image(folder / file, "LPS").warnings.empty()) << file;
    std::ifstream stream(folder / file, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(stream), {}};
    const auto at = text.find("\n" + key) + 1;
    text.erase(at, text.find('\n', at) + 1 - at);
    write_text(folder / file, text);
    const ImageFile read = read_image(folder / file, "LPS");
    ASSERT_EQ(read.warnings.size(), 1u) << file;
    EXPECT_NE(read.warnings[0].find(file + ": has no " + key), std::string::npos) << read.warnings[0];
    EXPECT_EQ(read.image.grid.origin_mm, Eigen::Vector3d::Zero());
  }
}

TEST(ImageIo, FormsOfNiftiThatDisagreeAreToldOf) {
  const TemporaryFolder folder;
  const auto warnings = [&folder](float offset_x) {
    write_nifti(folder / "a.nii", numbered_image());
    std::fstream stream(folder / "a.nii", std::ios::binary | std::ios::in | std::ios::out);
    const auto put = [&stream](std::streamoff at, auto value) {
      stream.seekp(at);
      stream.write(reinterpret_cast<const char*>(&value), sizeof value);
    };
    put(252, std::int16_t{1});
    put(268, offset_x), put(272, -20.0f), put(276, 30.0f);
    stream.close();
    return read_image(folder / "a.nii", "LPS").warnings;
  };
  EXPECT_TRUE(warnings(10.4f).empty()) << "half a voxel";
  const auto told = warnings(13);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("3.0 mm apart; the sform is taken"), std::string::npos) << told[0];
}

TEST(ImageIo, MetaImageOrientationLettersNameTheFrame) {
  const TemporaryFolder folder;
  const std::string head = "ObjectType = Image\nNDims = 3\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 1 2 3\n";
  const std::string tail =
      "ElementSpacing = 2 2 2\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n12345678";
  const auto read = [&](const std::string& letters) {
    write_text(folder / "a.mha", head + "AnatomicalOrientation = " + letters + "\n" + tail);
    return read_image(folder / "a.mha", "LPS");
  };
  EXPECT_EQ(read("RAI").frame, "LPS");  // from right to left, from anterior to posterior, from inferior to superior
  EXPECT_EQ(read("LPI").frame, "RAS");
  EXPECT_EQ(read("RAS").frame, "RAS");  // the other habit: towards
  EXPECT_EQ(read("???").frame, "");
  EXPECT_EQ(read("RAS").image.grid.origin_mm, Eigen::Vector3d(-1, -2, 3));
  EXPECT_NE(message_of([&] { read("ARI"); }).find("AnatomicalOrientation"), std::string::npos);
}

TEST(ImageIo, SamplesOfEveryWidthAndByteOrder) {
  const TemporaryFolder folder;
  const auto meta = [&](const std::string& type, const std::string& big, const std::string& bytes) {
    write_text(folder / "a.mha", "NDims = 3\nElementSpacing = 3 3 3\nDimSize = 2 1 1\nElementByteOrderMSB = " + big +
                                     "\nElementType = " + type + "\nElementDataFile = LOCAL\n" + bytes);
    return read_image(folder / "a.mha", "LPS").image.voxels;
  };
  const auto bytes = [](std::initializer_list<int> values) { return std::string(values.begin(), values.end()); };
  EXPECT_EQ(meta("MET_CHAR", "False", bytes({-1, 5})), (std::vector<float>{-1, 5}));
  EXPECT_EQ(meta("MET_USHORT", "True", bytes({1, 2, 0, 3})), (std::vector<float>{258, 3}));
  EXPECT_EQ(meta("MET_SHORT", "False", bytes({-2, -1, 3, 0})), (std::vector<float>{-2, 3}));
  EXPECT_EQ(meta("MET_INT", "True", bytes({0, 0, 1, 0, -1, -1, -1, -1})), (std::vector<float>{256, -1}));
}

TEST(ImageIo, NrrdWithoutSpaceTakesTheCasesFrame) {
  const TemporaryFolder folder;
  write_text(folder / "a.nrrd",
             "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nspacings: 3 4 5\nencoding: raw\n\n12345678");
  const Grid grid = read_image(folder / "a.nrrd", "RAS").image.grid;
  EXPECT_EQ(grid.spacing_mm, Eigen::Vector3d(3, 4, 5));
  EXPECT_EQ(grid.direction.diagonal(), Eigen::Vector3d(-1, -1, 1));
}

TEST(ImageIo, DetachedVoxelsAreFoundBesideTheHeader) {
  const TemporaryFolder folder;
  write_text(folder / "a.raw", "12345678");
  write_text(folder / "a.nhdr",
             "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nspacings: 3 4 5\nencoding: raw\ndata file: a.raw\n");
  write_text(folder / "a.mhd",
             "NDims = 3\nElementSpacing = 3 4 5\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = a.raw\n");
  EXPECT_EQ(read_image(folder / "a.nhdr", "LPS").image.voxels, read_image(folder / "a.mhd", "LPS").image.voxels);
}

}  // namespace
}  // namespace supine::segmentation
