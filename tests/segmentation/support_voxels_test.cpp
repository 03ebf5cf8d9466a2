// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/support_voxels.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "segmentation/tissue.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using testing::message_of;

/// A row of voxels along i: adipose 1, supports 7 and 8, air between them.
GreyImage row_of(const std::vector<float>& values) {
  GreyImage image;
  image.grid.size = {static_cast<int>(values.size()), 1, 1};
  image.grid.spacing_mm = {2, 4, 5};
  image.voxels = values;
  return image;
}

const std::vector<LabelSupport> two = {{"clamp", {7}}, {"rest", {8, 9}}};

LabelImage tissues_of(const GreyImage& values) {
  LabelImage labels{values.grid, {}};
  for (const float value : values.voxels)
    labels.voxels.push_back(static_cast<std::uint8_t>(value == 1  ? Tissue::adipose
                                                      : value > 1 ? Tissue::muscle
                                                                  : Tissue::air));
  return labels;
}

TEST(SupportVoxels, AreMarkedByTheirValues) {
  const SupportVoxels marked = mark_supports(row_of({0, 7, 1, 9, 8}), two);
  EXPECT_EQ(marked.names, (std::vector<std::string>{"clamp", "rest"}));
  EXPECT_EQ(marked.number, (std::vector<std::uint8_t>{0, 1, 0, 2, 2}));
  EXPECT_TRUE(mark_supports(row_of({0, 7}), {}).number.empty());
}

TEST(SupportVoxels, EachMustTouchTissue) {
  const auto complaint = [](const std::vector<float>& values) {
    const GreyImage image = row_of(values);
    return message_of([&] { check_supports(mark_supports(image, two), tissues_of(image), "labels.nrrd"); });
  };
  EXPECT_EQ(complaint({7, 1, 8}), "");
  const std::string none = complaint({7, 1, 0});
  EXPECT_NE(none.find("labels.nrrd: support 'rest' of [image.labels] has no voxel"), std::string::npos) << none;
  const std::string apart = complaint({7, 1, 0, 8, 9});
  EXPECT_NE(apart.find("support 'rest' holds nothing: none of its 2 voxels (first at (6.0, 0.0, 0.0) mm)"),
            std::string::npos)
      << apart;
}

TEST(SupportVoxels, ATouchThatIsNoiseOfTheLabelsIsRefused) {
  GreyImage image = row_of({7, 1, 8});
  const auto complaint = [&] {
    return message_of([&] { check_supports(mark_supports(image, two), tissues_of(image), "labels.nrrd"); });
  };
  EXPECT_EQ(complaint(), "") << "20 mm2";
  image.grid.spacing_mm = {9, 4, 4.9};
  EXPECT_NE(complaint().find("support 'clamp' (1 voxels, first at (0.0, 0.0, 0.0) mm) touches tissue on 19.6 mm2 only"),
            std::string::npos)
      << complaint();
}

TEST(SupportVoxels, TheNearestIsFoundInMillimetresOnATurnedGrid) {
  GreyImage image;
  image.grid.size = {9, 9, 9};
  image.grid.spacing_mm = {1, 4, 2};
  image.grid.origin_mm = {10, -20, 30};
  image.grid.direction = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  image.voxels.assign(image.grid.count(), 0);
  image.at(8, 4, 4) = 7;  // 4 voxels of 1 mm from the middle
  image.at(4, 2, 4) = 8;  // 2 voxels of 4 mm
  const SupportVoxels marked = mark_supports(image, two);
  const auto nearest = [&](const Eigen::Vector3d& index) {
    return nearest_support(marked, image.grid, image.grid.point(index));
  };
  EXPECT_EQ(nearest({4, 4, 4}), 0) << "4 mm against 8 mm";
  EXPECT_EQ(nearest({4, 3.2, 4}), 1) << "4.8 mm against 5.1 mm";
  EXPECT_EQ(nearest({40, 4, 4}), 0) << "outside of the image";
  EXPECT_EQ(nearest({4, -30, 4}), 1);
}

TEST(SupportVoxels, WithoutAVoxelNoneIsTheNearest) {
  const GreyImage image = row_of({0, 1, 0});
  const std::string complaint = message_of([&] { nearest_support(mark_supports(image, two), image.grid, {0, 0, 0}); });
  EXPECT_EQ(complaint, "the labels hold no voxel of a support");
}

}  // namespace
}  // namespace supine::segmentation
