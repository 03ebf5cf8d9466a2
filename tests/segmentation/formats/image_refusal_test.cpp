// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "segmentation/formats/image_io.h"
#include "segmentation/formats/labels_io.h"
#include "tests/segmentation/formats/image_files.h"

// One test per volume that read_image refuses: the message names the file and what is wrong.
namespace supine::segmentation {
namespace {

using namespace testing;

class ImageRefusal : public ::testing::Test {
 protected:
  void expect_refused(const std::string& file, const std::string& because) const {
    const std::string message = message_of([&] { read_image(folder_ / file, "LPS"); });
    EXPECT_NE(message.find(file), std::string::npos) << message;
    EXPECT_NE(message.find(because), std::string::npos) << message;
  }
  static std::string nrrd(const std::string& sizes, const std::string& directions, const std::string& more = "") {
    return "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: " + sizes +
           "\nspace directions: " + directions + "\n" + more + "encoding: raw\nspace origin: (0,0,0)\n\n" +
           std::string(64, 'x');
  }
  TemporaryFolder folder_;
};

TEST_F(ImageRefusal, MissingFileAndUnknownFormat) {
  expect_refused("none.nrrd", "no such file");
  write_text(folder_ / "a.jpg", "x");
  expect_refused("a.jpg", "unknown image format");
}

// Cut anywhere, a file is refused or (when only closing tags or padding went) gives the same voxels.
TEST_F(ImageRefusal, TruncatedFiles) {
  const GreyImage image = numbered_image();
  write_nrrd(folder_ / "a.nrrd", image);
  write_gzip_nrrd(folder_ / "b.nrrd", image);
  write_meta_image(folder_ / "a.mha", image);
  write_nifti(folder_ / "a.nii", image);
  write_nifti(folder_ / "a.nii.gz", image);
  write_vti(folder_ / "a.vti", image);
  for (const std::string file : {"a.nrrd", "b.nrrd", "a.mha", "a.nii", "a.nii.gz", "a.vti"}) {
    ASSERT_EQ(read_image(folder_ / file, "LPS").image.voxels, image.voxels) << file;
    const auto whole = std::filesystem::file_size(folder_ / file);
    for (std::size_t missing = 1; missing < whole; missing += 11) {
      std::filesystem::resize_file(folder_ / file, whole - missing);
      const std::string message = message_of([&] {
        EXPECT_EQ(read_image(folder_ / file, "LPS").image.voxels, image.voxels)
            << file << " without " << missing << " bytes";
      });
      EXPECT_TRUE(missing <= 300 || message.find(file) != std::string::npos) << missing << " " << message;
    }
  }
}

TEST_F(ImageRefusal, TruncatedVoxelsAreCalledTruncated) {
  const GreyImage image = numbered_image();
  write_nrrd(folder_ / "a.nrrd", image);
  write_meta_image(folder_ / "a.mha", image);
  write_nifti(folder_ / "a.nii.gz", image);
  for (const std::string file : {"a.nrrd", "a.mha", "a.nii.gz"}) {
    std::filesystem::resize_file(folder_ / file, std::filesystem::file_size(folder_ / file) - 20);
    expect_refused(file, "truncated");
  }
}

TEST_F(ImageRefusal, SpacingZero) {
  write_text(folder_ / "a.nrrd", nrrd("4 4 4", "(0,0,0) (0,1,0) (0,0,1)"));
  expect_refused("a.nrrd", "spacing");
  GreyImage image = numbered_image();
  image.grid.spacing_mm.y() = 0;
  write_meta_image(folder_ / "a.mha", image);
  expect_refused("a.mha", "ElementSpacing");
  write_nifti(folder_ / "a.nii", image, Form::qform);
  expect_refused("a.nii", "pixdim[2]");
  write_nifti(folder_ / "a.nii", image, Form::sform);
  expect_refused("a.nii", "spacing of axis 1 is 0");
}

TEST_F(ImageRefusal, Metres) {
  GreyImage image = numbered_image();
  image.grid.spacing_mm /= 1000;
  write_nrrd(folder_ / "a.nrrd", image);
  expect_refused("a.nrrd", "scale spacing and origin by 1000");
  write_text(folder_ / "b.nrrd", nrrd("4 4 4", "(1,0,0) (0,1,0) (0,0,1)", "space units: \"m\" \"m\" \"m\"\n"));
  expect_refused("b.nrrd", "space units");
}

TEST_F(ImageRefusal, SkewAxes) {
  write_text(folder_ / "a.nrrd", nrrd("4 4 4", "(1,0,0) (0.1,1,0) (0,0,1)"));
  expect_refused("a.nrrd", "right angles");
}

TEST_F(ImageRefusal, NearlyOrthonormalAxesAreMadeExact) {
  std::string text = nrrd("4 4 4", "(1,0,0) (0.0005,1,0) (0,0,1)");
  text.back() = 'y';  // a volume of one value is refused
  write_text(folder_ / "a.nrrd", text);
  const Eigen::Matrix3d d = read_image(folder_ / "a.nrrd", "").image.grid.direction;
  EXPECT_NEAR((d.transpose() * d - Eigen::Matrix3d::Identity()).norm(), 0, 1e-14);
}

TEST_F(ImageRefusal, VolumeOfOneValue) {
  write_text(folder_ / "a.nrrd", nrrd("4 4 4", "(1,0,0) (0,1,0) (0,0,1)"));
  expect_refused("a.nrrd", "every voxel is 120");
}

TEST_F(ImageRefusal, ColourAndFourAxes) {
  write_text(folder_ / "a.nrrd",
             "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 2 2 2\nencoding: raw\n\n" + std::string(24, 'x'));
  expect_refused("a.nrrd", "dimension 4");
  write_text(folder_ / "b.nrrd",
             "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 4 4\nkinds: RGB-color domain domain\nspacings: nan 1 1\n"
             "encoding: raw\n\n" +
                 std::string(48, 'x'));
  expect_refused("b.nrrd", "RGB-color");
  write_text(folder_ / "a.mha", "NDims = 3\nElementNumberOfChannels = 3\nElementDataFile = LOCAL\n");
  expect_refused("a.mha", "ElementNumberOfChannels");
}

TEST_F(ImageRefusal, VoxelThatIsNotANumber) {
  GreyImage image = numbered_image();
  image.at(2, 1, 0) = NAN;
  write_nrrd(folder_ / "a.nrrd", image);
  expect_refused("a.nrrd", "voxel (2, 1, 0) is nan");
}

TEST_F(ImageRefusal, UnknownFrame) {
  write_vti(folder_ / "a.vti", numbered_image(), "XYZ");
  expect_refused("a.vti", "\"XYZ\"");
}

TEST_F(ImageRefusal, NotWhatTheExtensionSays) {
  for (const std::string file : {"a.nrrd", "a.mha", "a.nii", "a.vti"}) {
    write_text(folder_ / file, std::string(1000, '?'));
    EXPECT_NE(message_of([&] { read_image(folder_ / file, "LPS"); }), "");
  }
}

}  // namespace
}  // namespace supine::segmentation
