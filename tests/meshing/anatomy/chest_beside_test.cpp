// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/chest_beside.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "meshing/anatomy.h"
#include "tests/support/shapes.h"
#include "tests/support/taylor.h"

namespace supine::meshing {
namespace {

constexpr double muscle_radius_mm = 145, rim_mm = 80, skin_over_muscle_mm = 12;

struct Chest : ::testing::Test {
  TetMesh mesh = testing::dome_mesh({.foot_radius_mm = 64,
                                     .rim_thickness_mm = skin_over_muscle_mm,
                                     .rim_factor = rim_mm / 64,
                                     .muscle_radius_mm = muscle_radius_mm});
  Anatomy anatomy = compute_anatomy(mesh, "left");
  ChestBeside chest = *chest_beside(mesh, anatomy);

  /// At arc lengths (lateral, head) from the axis and a height over the muscle.
  static Eigen::Vector3d over_muscle(double lateral, double head, double height) {
    const double angle = lateral / muscle_radius_mm, r = muscle_radius_mm + height;
    return {r * std::sin(angle), muscle_radius_mm - r * std::cos(angle), head};
  }
};

TEST_F(Chest, GoesOnBesideTheBreastAsThickAsTheRim) {
  for (int i = 0; i < 12; ++i) {
    const double angle = std::numbers::pi * i / 6;
    const auto at = [&](double arc, double height) {
      return chest.at(over_muscle(arc * std::cos(angle), arc * std::sin(angle), height));
    };
    EXPECT_EQ(at(rim_mm + 30, 20).share, 1) << i;
    EXPECT_NEAR(at(rim_mm + 20, 20).gap_mm, 20 - skin_over_muscle_mm, 0.6) << i;
    EXPECT_NEAR(at(rim_mm + 20, 2).gap_mm, 2 - skin_over_muscle_mm, 0.6) << i;
    EXPECT_NEAR(at(rim_mm + 20, 20).gradient.norm(), 1, 0.05) << i;
  }
}

TEST_F(Chest, IsNotThereUnderTheBreast) {
  for (Eigen::Index n = 0; n < mesh.points.rows(); ++n)
    EXPECT_EQ(chest.at(mesh.points.row(n).transpose()).share, 0) << mesh.points.row(n);
}

TEST_F(Chest, EveryFunctionHasItsDerivatives) {
  const Eigen::Vector3d way(0.6, -0.3, 0.7);
  for (const Eigen::Vector3d& place : {over_muscle(74, 56, 9), over_muscle(-92, 10, 14), over_muscle(3, -100, 5)}) {
    const auto here = chest.at(place);
    ASSERT_GT(here.share, 0);
    if (here.share < 1) {
      EXPECT_GT(testing::taylor_order([&](double h) { return chest.at(place + h * way).share; },
                                      here.share_gradient.dot(way), 0.1),
                1.9);
      EXPECT_GT(
          testing::taylor_order([&](double h) { return Eigen::Vector3d(chest.at(place + h * way).share_gradient); },
                                Eigen::Vector3d(here.share_hessian * way), 0.1),
          1.9);
    }
    EXPECT_GT(
        testing::taylor_order([&](double h) { return chest.at(place + h * way).gap_mm; }, here.gradient.dot(way), 0.5),
        1.9);
    EXPECT_GT(testing::taylor_order([&](double h) { return Eigen::Vector3d(chest.at(place + h * way).gradient); },
                                    Eigen::Vector3d(here.hessian * way), 0.1),
              1.8);
  }
}

TEST_F(Chest, AnObjectAndAClosedSkinHaveNone) {
  Anatomy object = anatomy;
  object.side = "none";
  EXPECT_FALSE(chest_beside(mesh, object));
  TetMesh closed = mesh;
  closed.region.setConstant(static_cast<int>(reconstruction::Region::skin));
  EXPECT_FALSE(chest_beside(closed, anatomy));
}

}  // namespace
}  // namespace supine::meshing
