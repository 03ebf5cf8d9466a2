// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/hot_spots.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace supine::diagnosis {
namespace {

using Eigen::Index;

/// A flat skin of 120 by 120 mm in triangles of 5 mm, and readings above it, one in the middle of each triangle.
class HotSpots : public ::testing::Test {
 protected:
  static constexpr int n = 24;
  static constexpr double step_mm = 5, noise_mm = 0.5;

  static calibration::ModelSkin sheet() {
    Points points((n + 1) * (n + 1), 3);
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) points.row(i * (n + 1) + j) << step_mm * i, step_mm * j, 0;
    Triangles triangles(2 * n * n, 3);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const int a = i * (n + 1) + j, b = a + n + 1;
        triangles.row(2 * (i * n + j)) << a, b, b + 1;
        triangles.row(2 * (i * n + j) + 1) << a, b + 1, a + 1;
      }
    return {points, triangles};
  }

  /// What the readings are off by, by their place, and white noise.
  SkinError error(const std::function<double(double x, double y)>& off, double noise = noise_mm, double pose = 0) {
    std::mt19937 generator(7);
    std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
    const Index count = skin.triangles().rows();
    calibration::Residuals residuals;
    residuals.distance_mm.resize(count);
    Points middles(count, 3);
    for (Index t = 0; t < count; ++t) {
      middles.row(t).setZero();
      for (int k = 0; k < 3; ++k) middles.row(t) += skin.distance().points().row(skin.triangles()(t, k)) / 3;
      residuals.distance_mm[t] = off(middles(t, 0), middles(t, 1)) + (noise > 0 ? normal(generator) : 0);
    }
    residuals.place = residuals.on_skin = middles;
    residuals.sigma_mm = Eigen::VectorXd::Constant(count, noise_mm);
    residuals.pose = Eigen::VectorXi::Constant(count, static_cast<int>(pose));
    residuals.point = Eigen::VectorXi::LinSpaced(count, 0, static_cast<int>(count) - 1);
    calibration::Prediction prediction;
    prediction.poses.resize(1);
    calibration::scan_to_model(skin, middles, prediction.poses[0].distances);
    return skin_error(skin, residuals, prediction, 0);
  }

  std::vector<HotSpot> spots(const SkinError& at) const { return find_hot_spots(skin, at, areas, "supine"); }

  calibration::ModelSkin skin = sheet();
  calibration::SkinAreas areas{{"left", "right"}, halves()};

  static Eigen::VectorXi halves() {
    Eigen::VectorXi half((n + 1) * (n + 1));
    for (int p = 0; p < half.size(); ++p) half[p] = p / (n + 1) > n / 2 ? 1 : 0;
    return half;
  }
};

double disc(double x, double y, double cx, double cy, double radius) {
  return std::hypot(x - cx, y - cy) < radius ? 1.0 : 0.0;
}

TEST_F(HotSpots, WhatIsOffEverywhereKeepsItsSizeAndAveragingLessensItsNoise) {
  const SkinError even = error([](double, double) { return 2.0; }, 0);
  EXPECT_LT((even.mean_mm.array() - 2).abs().maxCoeff(), 1e-12) << "an average of equals";
  const int inner = n / 2 * (n + 1) + n / 2;
  EXPECT_LT(even.error_mm[inner], 0.5 * noise_mm);
  EXPECT_GT(even.error_mm[inner], 0.1 * noise_mm) << "some 20 readings each";
}

TEST_F(HotSpots, ReadingsSpreadToNeighboursAndNoFurther) {
  const Index one = 2 * (n / 2 * n + n / 2);
  const Eigen::RowVector3d at = skin.distance().points().row(skin.triangles()(one, 0));
  const SkinError peak = error(
      [&](double x, double y) { return disc(x, y, at.x() + step_mm * 2 / 3, at.y() + step_mm / 3, 0.1 * step_mm); }, 0);
  EXPECT_GT(peak.mean_mm[skin.triangles()(one, 0)], 0.02);
  for (Index p = 0; p < peak.mean_mm.size(); ++p) {
    const double away = (skin.distance().points().row(p) - at).norm();
    if (away > 3 * step_mm) {
      EXPECT_EQ(peak.mean_mm[p], 0) << away;
    } else if (away < 1.1 * step_mm) {
      EXPECT_GT(peak.mean_mm[p], 0) << away;
    }
  }
}

TEST_F(HotSpots, NoiseAloneIsNone) {
  EXPECT_TRUE(spots(error([](double, double) { return 0.0; })).empty());
}

TEST_F(HotSpots, EachPieceIsFoundWithPlaceSizeSignAndArea) {
  const auto found =
      spots(error([](double x, double y) { return 2 * disc(x, y, 30, 60, 20) - 1.5 * disc(x, y, 90, 60, 15); }));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].area, "left");
  EXPECT_EQ(found[1].area, "right");
  EXPECT_EQ(found[0].pose, "supine");
  // Smoothing over an edge widens a piece and lowers its border.
  EXPECT_NEAR(found[0].mean_signed_mm, 2, 0.5);
  EXPECT_NEAR(found[1].mean_signed_mm, -1.5, 0.5);
  EXPECT_NEAR(found[0].area_cm2, 12.6, 5);
  EXPECT_NEAR(found[1].area_cm2, 7.1, 4);
  EXPECT_LT((found[0].centre_mm - Eigen::Vector3d(30, 60, 0)).norm(), 3);
  EXPECT_LT((found[1].centre_mm - Eigen::Vector3d(90, 60, 0)).norm(), 3);
}

TEST_F(HotSpots, TouchingPiecesOfBothSignsStayTwoAndSmallOnesGo) {
  const auto found = spots(error(
      [](double x, double y) { return (x < 60 ? 2.0 : -2.0) * disc(x, y, 60, 60, 20) + 2 * disc(x, y, 105, 15, 6); }));
  ASSERT_EQ(found.size(), 2u) << "the third holds about one cm²";
  EXPECT_LT(found[0].mean_signed_mm * found[1].mean_signed_mm, 0);
}

TEST_F(HotSpots, PiecesInOppositeCornersAreOfOneSize) {
  const double far = n * step_mm;
  const auto found =
      spots(error([&](double x, double y) { return 2 * disc(x, y, 0, 0, 25) + 2 * disc(x, y, far, far, 25); }, 0));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].area_cm2, found[1].area_cm2, 1e-9);
  EXPECT_NEAR(found[0].mean_signed_mm, found[1].mean_signed_mm, 1e-9);
}

}  // namespace
}  // namespace supine::diagnosis
