// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/support/two_breasts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "common/error.h"
#include "meshing/anatomy.h"
#include "meshing/anatomy/cleft.h"
#include "meshing/tetrahedra/ligament_ring.h"
#include "tests/support/shapes.h"

namespace supine::meshing {
namespace {

using supine::testing::two_breasts_mesh;

class TwoBreastsAnatomy : public ::testing::TestWithParam<bool> {
 protected:
  TetMesh mesh = two_breasts_mesh({.left_height_mm = 50, .right_height_mm = 40, .apart = GetParam()});
  Anatomy anatomy = compute_anatomy(mesh, "both");
};

TEST_P(TwoBreastsAnatomy, EachHasItsOwnFootNippleAndDirections) {
  EXPECT_EQ(anatomy.side, "both");
  EXPECT_LT(std::abs(anatomy.sternum_x_mm), 6);
  ASSERT_EQ(anatomy.breasts.size(), 2u);
  const Anatomy &left = anatomy.breasts[0], &right = anatomy.breasts[1];
  EXPECT_EQ(left.side, "left");
  EXPECT_EQ(right.side, "right");
  EXPECT_LT((left.foot_centre_mm - Eigen::Vector3d(75, 0, 0)).norm(), 5);
  EXPECT_LT((right.foot_centre_mm - Eigen::Vector3d(-75, 0, 0)).norm(), 5);
  for (const Anatomy* one : {&left, &right}) EXPECT_NEAR(one->foot_radius_mm, 55, 0.12 * 55) << one->side;
  EXPECT_NEAR(left.mound_height_mm, 62, 3);
  EXPECT_NEAR(right.mound_height_mm, 52, 3);
  EXPECT_EQ(anatomy.mound_height_mm, left.mound_height_mm);
  EXPECT_GT(left.lateral.x(), 0.99);
  EXPECT_LT(right.lateral.x(), -0.99);
  EXPECT_NEAR(mesh.points(left.nipple_point, 0), 75, 12);
  EXPECT_NEAR(mesh.points(right.nipple_point, 0), -75, 12);
}

TEST_P(TwoBreastsAnatomy, EveryPointHasTheCoordinatesOfItsOwnBreast) {
  for (Eigen::Index p = 0; p < mesh.points.rows(); ++p) {
    const bool is_left = mesh.points(p, 0) >= anatomy.sternum_x_mm;
    ASSERT_EQ(anatomy.breast_of(p), is_left ? 0 : 1);
    ASSERT_EQ(anatomy.q.row(p), anatomy.breast_frame(anatomy.breast_of(p)).q.row(p));
    if (std::abs(mesh.points(p, 0)) > 110) {
      ASSERT_GT(anatomy.q(p, 0), 0) << "outer side, " << mesh.points.row(p);
    }
    if (std::abs(mesh.points(p, 0)) < 40) {
      ASSERT_LT(anatomy.q(p, 0), 0) << "sternal side, " << mesh.points.row(p);
    }
    if (std::abs(mesh.points(p, 0)) > 30) {
      ASSERT_EQ(anatomy.chart(p).x() > 0, is_left) << mesh.points.row(p);
    }
  }
}

TEST_P(TwoBreastsAnatomy, AreasCarryTheSide) {
  const auto names = anatomy.all_area_names();
  EXPECT_EQ(names.size(), 2 * area_names().size());
  std::set<std::string> seen;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (mesh.region[f] != static_cast<int>(reconstruction::Region::skin)) continue;
    for (const int p : mesh.faces.row(f)) {
      const std::string name = anatomy.area_name_of(p);
      ASSERT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
      ASSERT_TRUE(name.starts_with(mesh.points(p, 0) >= anatomy.sternum_x_mm ? "left " : "right ")) << name;
      seen.insert(name);
    }
  }
  EXPECT_EQ(seen.size(), names.size());
  EXPECT_EQ(anatomy.area_name_of(anatomy.breasts[0].nipple_point), "left nipple area");
}

TEST_P(TwoBreastsAnatomy, RingsAreMarkedAroundBoth) {
  mark_ligament_ring(mesh, anatomy);
  int marked[2] = {0, 0};
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    if (mesh.region[f] == static_cast<int>(reconstruction::Region::ligament))
      ++marked[anatomy.breast_of(mesh.faces(f, 0))];
  EXPECT_GT(marked[0], 20);
  EXPECT_NEAR(marked[0], marked[1], 0.3 * marked[0]);
}

INSTANTIATE_TEST_SUITE_P(Pieces, TwoBreastsAnatomy, ::testing::Values(false, true),
                         [](const auto& place) { return place.param ? "two" : "one"; });

TEST(TwoBreasts, OneMoundIsNotTwo) {
  try {
    compute_anatomy(testing::dome_mesh(), "both");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no valley between two breasts"), std::string::npos) << error.what();
  }
}

TEST(TwoBreasts, CleftIsTheMiddleOfItsFloor) {
  std::vector<Eigen::Vector2d> heights;
  for (double x = -100; x <= 130; x += 1) {
    const double left = 40 * std::exp(-std::pow((x - 80) / 25, 2)), right = 30 * std::exp(-std::pow((x + 60) / 25, 2));
    heights.emplace_back(x, 10 + left + right);
  }
  EXPECT_NEAR(find_cleft_x(heights), 10, 6);
  EXPECT_THROW(find_cleft_x({}), InputError);
}

}  // namespace
}  // namespace supine::meshing
