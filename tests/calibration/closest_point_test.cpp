// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/closest_point.h"

#include <gtest/gtest.h>

#include "tests/calibration/shapes.h"

namespace supine::calibration {
namespace {

const Eigen::Vector3d a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);

void expect(const Eigen::Vector3d& query, const Eigen::Vector3d& weight, Feature feature, int corner) {
  const TrianglePoint at = closest_on_triangle(query, a, b, c);
  EXPECT_TRUE(at.weight.isApprox(weight, 1e-15)) << at.weight.transpose();
  EXPECT_EQ(at.feature, feature);
  EXPECT_EQ(at.corner, corner);
}

}  // namespace

TEST(ClosestOnTriangle, ExactWeightsInAllSevenRegions) {
  expect({1, 1, 9}, {0.5, 0.25, 0.25}, Feature::face, 0);
  expect({-1, -2, 3}, {1, 0, 0}, Feature::vertex, 0);
  expect({6, -1, 1}, {0, 1, 0}, Feature::vertex, 1);
  expect({-1, 6, -1}, {0, 0, 1}, Feature::vertex, 2);
  expect({1, -2, 5}, {0.75, 0.25, 0}, Feature::edge, 0);
  expect({3, 3, 1}, {0, 0.5, 0.5}, Feature::edge, 1);
  expect({-7, 3, 0}, {0.25, 0, 0.75}, Feature::edge, 2);
}

TEST(ClosestOnTriangle, PointOnAnEdgeUpToRoundingIsOnTheEdge) {
  EXPECT_EQ(closest_on_triangle({1, 1e-12, 2}, a, b, c).feature, Feature::edge);
  EXPECT_EQ(closest_on_triangle({1e-12, 1e-12, 2}, a, b, c).feature, Feature::vertex);
}

TEST(ClosestOnTriangle, NoPointOfTheTriangleIsCloser) {
  const Points corners = testing::random_points(3, -5, 5, 1);
  const Points queries = testing::random_points(200, -9, 9, 2);
  for (const auto& query : queries.rowwise()) {
    const Eigen::Vector3d weight = closest_on_triangle(query, corners.row(0), corners.row(1), corners.row(2)).weight;
    const double found = (corners.transpose() * weight - query.transpose()).norm();
    for (int i = 0; i <= 20; ++i) {
      for (int j = 0; i + j <= 20; ++j) {
        const Eigen::Vector3d other(i / 20.0, j / 20.0, 1 - (i + j) / 20.0);
        ASSERT_LE(found, (corners.transpose() * other - query.transpose()).norm() + 1e-12);
      }
    }
  }
}

}  // namespace supine::calibration
