// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/vector_io.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/error.h"
#include "segmentation/formats/image_io.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

namespace fs = std::filesystem;

GreyImage oblique_image(double add) {
  GreyImage image = testing::numbered_image(testing::oblique());
  image.grid.origin_mm = {12.5, -40, 7};
  for (float& v : image.voxels) v += static_cast<float>(add);
  return image;
}

// What a program reads is where and what was written: whole numbers, fractions, negative ones, in both formats.
TEST(WriteImage, IsReadBackInPlaceByTheReaders) {
  const testing::TemporaryFolder folder;
  for (const char* name : {"a.nrrd", "a.nii", "a.nii.gz"})
    for (const double add : {0.0, 0.25, -30.0, 40000.0, 70000.0}) {
      const GreyImage image = oblique_image(add);
      write_image(image, folder / name);
      const ImageFile read = read_image(folder / name, "");
      EXPECT_EQ(read.image.voxels, image.voxels) << name << " " << add;
      EXPECT_LT((read.image.grid.origin_mm - image.grid.origin_mm).norm(), 1e-5);
      EXPECT_LT((read.image.grid.spacing_mm - image.grid.spacing_mm).norm(), 1e-5);
      EXPECT_LT((read.image.grid.direction - image.grid.direction).norm(), 1e-5);
    }
}

TEST(WriteImage, StoresWholeNumbersSmall) {
  const testing::TemporaryFolder folder;
  const auto size_of = [&](double add) {
    write_image(oblique_image(add), folder / "b.nii");
    return fs::file_size(folder / "b.nii");
  };
  EXPECT_EQ(size_of(0), 352u + 60);
  EXPECT_EQ(size_of(-1), 352u + 2 * 60);
  EXPECT_EQ(size_of(40000), 352u + 2 * 60);
  EXPECT_EQ(size_of(0.5), 352u + 4 * 60);
}

TEST(WriteImage, AMirroredGridStaysOneInItsQform) {
  const testing::TemporaryFolder folder;
  GreyImage image = oblique_image(0);
  image.grid.direction.col(2) *= -1;
  write_image(image, folder / "c.nii");
  // Without the sform the reader takes the quaternion.
  std::string bytes(fs::file_size(folder / "c.nii"), '\0');
  std::ifstream(folder / "c.nii", std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes[254] = bytes[255] = 0;
  testing::write_text(folder / "c.nii", bytes);
  const ImageFile read = read_image(folder / "c.nii", "");
  EXPECT_LT((read.image.grid.direction - image.grid.direction).norm(), 1e-5);
}

TEST(WriteImage, RefusesOtherFormats) {
  const testing::TemporaryFolder folder;
  EXPECT_THROW(write_image(oblique_image(0), folder / "d.mha"), InputError);
  EXPECT_THROW(write_image(oblique_image(0), folder / "no" / "d.nrrd"), InputError);
}

}  // namespace
}  // namespace supine::segmentation
