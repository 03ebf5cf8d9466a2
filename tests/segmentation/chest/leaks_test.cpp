// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/leaks.h"

#include <gtest/gtest.h>

namespace supine::segmentation {
namespace {

/// A round chest, 100 mm in radius, of 50 levels 2 mm apart.
ChestWall round_chest() {
  ChestWall wall;
  wall.step_z_mm = 2;
  wall.z0_mm = -50;
  wall.step_angle_rad = 0.0175;
  wall.first_angle_rad = -90 * wall.step_angle_rad;
  wall.radius_mm.setConstant(181, 50, 100);
  wall.cost.setZero(181, 50);
  return wall;
}

TEST(UnevenChest, ABulgeOnOneSideIsNamedWhereItIs) {
  ChestWall wall = round_chest();
  wall.radius_mm.block(110, 30, 30, 10) += 14;  // to her left, above the middle: 5 cm by 2 cm
  const auto patches = find_uneven(wall, 50);
  ASSERT_EQ(patches.size(), 1U);
  EXPECT_NEAR(patches[0].area_cm2, 12, 2);
  EXPECT_GT(patches[0].middle_mm.x(), 30);
  EXPECT_NEAR(patches[0].middle_mm.z(), 19, 1);
  EXPECT_NE(describe_uneven(patches[0]).find("12 cm2"), std::string::npos) << describe_uneven(patches[0]);
}

TEST(UnevenChest, BothSidesAlikeATurnedBodyAndWhatLiesBehindAreNot) {
  ChestWall wall = round_chest();
  wall.radius_mm.block(110, 30, 30, 10) += 14;
  wall.radius_mm.block(41, 30, 30, 10) += 14;
  EXPECT_TRUE(find_uneven(wall, 50).empty());
  ChestWall turned = round_chest();
  turned.radius_mm.bottomRows(60) += 14;
  EXPECT_TRUE(find_uneven(turned, 50).empty());
  ChestWall behind = round_chest();
  behind.radius_mm.block(110, 30, 30, 10) += 14;
  EXPECT_TRUE(find_uneven(behind, -95).empty());
}

}  // namespace
}  // namespace supine::segmentation
