// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/surface_topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/calibration/shapes.h"

namespace supine::calibration {
namespace {

int border_edges(const SurfaceTopology& topology) {
  int count = 0;
  for (int t = 0; t < topology.vertex().rows(); ++t) {
    for (int k = 0; k < 3; ++k) count += topology.border_edge(t, k);
  }
  return count;
}

// Each triangle with points of its own.
reconstruction::Surface soup(const reconstruction::Surface& surface) {
  reconstruction::Surface out{Points(3 * surface.triangles.rows(), 3), surface.triangles, {}};
  for (int i = 0; i < out.points.rows(); ++i) {
    out.points.row(i) = surface.points.row(surface.triangles(i / 3, i % 3));
    out.triangles(i / 3, i % 3) = i;
  }
  return out;
}

// Directed edges are unique exactly when all neighbours agree.
bool consistent(const SurfaceTopology& topology, const Triangles& triangles) {
  std::set<std::pair<int, int>> directed;
  for (const auto& t : triangles.rowwise()) {
    for (int k = 0; k < 3; ++k) {
      const auto& vertex = topology.vertex_of_point();
      if (!directed.insert({vertex[t[k]], vertex[t[(k + 1) % 3]]}).second) return false;
    }
  }
  return true;
}

}  // namespace

TEST(SurfaceTopology, BorderOfASheetAndOfItsHole) {
  const auto flat = testing::sheet(0, 6, 6);
  EXPECT_EQ(border_edges(SurfaceTopology(flat.points, flat.triangles)), 24);
  const auto holed =
      testing::without(flat, [](const Eigen::Vector3d& p) { return p.x() > 2 && p.x() < 4 && p.y() > 2 && p.y() < 4; });
  EXPECT_EQ(border_edges(SurfaceTopology(holed.points, holed.triangles)), 24 + 8);
}

TEST(SurfaceTopology, ClosedSphereHasNoBorderAlsoAsASoup) {
  const auto ball = testing::sphere(5, 2);
  EXPECT_EQ(border_edges(SurfaceTopology(ball.points, ball.triangles)), 0);
  const auto loose = soup(ball);
  EXPECT_EQ(border_edges(SurfaceTopology(loose.points, loose.triangles)), 0);
}

TEST(SurfaceTopology, TriangleWithACornerTwiceHidesNoBorder) {
  auto flat = testing::sheet(0, 2, 2);
  flat.triangles.conservativeResize(9, 3);
  flat.triangles.row(8) << 0, 1, 1;
  EXPECT_EQ(border_edges(SurfaceTopology(flat.points, flat.triangles)), 8);
}

TEST(OrientPieces, NeighboursAgreeAfterwardsAndPiecesAreCounted) {
  auto ball = testing::sphere(5, 2);
  for (int t = 0; t < ball.triangles.rows(); t += 3) std::swap(ball.triangles(t, 1), ball.triangles(t, 2));
  const auto other = testing::sphere(1, 1, {20, 0, 0});
  const auto points = ball.points.rows(), triangles = ball.triangles.rows();
  ball.points.conservativeResize(points + other.points.rows(), 3);
  ball.points.bottomRows(other.points.rows()) = other.points;
  ball.triangles.conservativeResize(triangles + other.triangles.rows(), 3);
  ball.triangles.bottomRows(other.triangles.rows()) = other.triangles.array() + static_cast<int>(points);
  const SurfaceTopology topology(ball.points, ball.triangles);
  EXPECT_FALSE(consistent(topology, ball.triangles));
  const auto piece = orient_pieces(topology, ball.triangles);
  EXPECT_TRUE(consistent(topology, ball.triangles));
  EXPECT_EQ(*std::max_element(piece.begin(), piece.end()), 1);
}

}  // namespace supine::calibration
