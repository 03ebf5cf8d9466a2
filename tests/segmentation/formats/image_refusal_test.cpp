// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>

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

template <class T>
void overwrite(const std::filesystem::path& file, std::streamoff at, T value) {
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekp(at);
  stream.write(reinterpret_cast<const char*>(&value), sizeof value);
}

TEST_F(ImageRefusal, VoxelsThatTheHeaderDoesNotPromise) {
  const GreyImage image = numbered_image();
  GreyImage more = image;
  more.voxels.push_back(1);
  write_nrrd(folder_ / "a.nrrd", more);
  write_meta_image(folder_ / "a.mha", more);
  write_nifti(folder_ / "a.nii", more);
  write_nifti(folder_ / "a.nii.gz", more);
  for (const std::string file : {"a.nrrd", "a.mha", "a.nii", "a.nii.gz"}) expect_refused(file, "240 bytes of voxels");
}

TEST_F(ImageRefusal, PackedVoxelsThatTheHeaderDoesNotPromise) {
  const std::string text =
      "NDims = 3\nDimSize = 2 2 2\nElementSpacing = 5 5 5\nOffset = 0 0 0\nCompressedData = True\n"
      "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
  for (const std::string voxels : {"12345678", "123456789"}) {
    uLongf size = compressBound(voxels.size());
    std::string packed(size, ' ');
    compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(voxels.data()),
             voxels.size());
    write_text(folder_ / "a.mha", text + packed.substr(0, size));
    if (voxels.size() > 8)
      expect_refused("a.mha", "8 bytes of voxels, and more follow");
    else
      EXPECT_EQ(read_image(folder_ / "a.mha", "LPS").image.voxels.size(), 8u);
  }
}

TEST_F(ImageRefusal, HeadersThatContradictThemselves) {
  write_nifti(folder_ / "a.nii", numbered_image());
  overwrite(folder_ / "a.nii", 84, 2.4f);  // pixdim[2] of 0.8 mm, as a resampling leaves it
  expect_refused("a.nii", "pixdim[2] is 2.4");
  expect_refused("a.nii", "steps of 0.8 mm");
  write_nifti(folder_ / "b.nii", numbered_image());
  overwrite(folder_ / "b.nii", 72, std::int16_t{8});
  expect_refused("b.nii", "bitpix is 8 and datatype 16 has 32 bits");
  overwrite(folder_ / "b.nii", 72, std::int16_t{0});
  EXPECT_NO_THROW(read_image(folder_ / "b.nii", "LPS")) << "not filled in";
  write_meta_image(folder_ / "a.mha", numbered_image(3 * Eigen::Matrix3d::Identity()));
  expect_refused("a.mha", "row 1 of TransformMatrix has the length 3, beside the ElementSpacing 0.7 mm");
}

TEST_F(ImageRefusal, NotWhatTheExtensionSays) {
  for (const std::string file : {"a.nrrd", "a.mha", "a.nii", "a.vti"}) {
    write_text(folder_ / file, std::string(1000, '?'));
    EXPECT_NE(message_of([&] { read_image(folder_ / file, "LPS"); }), "");
  }
}

}  // namespace
}  // namespace supine::segmentation
