// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/surface_distance.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <cstring>
#include <limits>
#include <vector>

#include "calibration/closest_point.h"
#include "common/error.h"
#include "tests/calibration/shapes.h"

namespace supine::calibration {
namespace {

template <class Matrix>
bool same_bytes(const Matrix& a, const Matrix& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(*a.data())) == 0;
}

double brute_force_mm(const reconstruction::Surface& surface, const Eigen::Vector3d& query) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& t : surface.triangles.rowwise()) {
    const Eigen::Vector3d a = surface.points.row(t[0]), b = surface.points.row(t[1]), c = surface.points.row(t[2]);
    const Eigen::Vector3d w = closest_on_triangle(query, a, b, c).weight;
    best = std::min(best, (w[0] * a + w[1] * b + w[2] * c - query).norm());
  }
  return best;
}

}  // namespace

TEST(SurfaceDistance, AgreesWithBruteForce) {
  const auto ball = testing::sphere(10, 2);
  const Points queries = testing::random_points(300, -15, 15, 3);
  ClosestPoints closest;
  SurfaceDistance(ball.points, ball.triangles).closest(queries, closest);
  for (int i = 0; i < queries.rows(); ++i) {
    ASSERT_NEAR(closest.distance_mm[i], brute_force_mm(ball, queries.row(i)), 1e-12);
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (int k = 0; k < 3; ++k) sum += closest.weight(i, k) * ball.points.row(closest.node(i, k));
    ASSERT_TRUE(sum.isApprox(closest.point.row(i), 1e-14));
    ASSERT_EQ(closest.node.row(i), ball.triangles.row(closest.triangle[i]));
  }
}

TEST(SurfaceDistance, NamesTheLowestTriangleAndThePseudoNormalOfSharedFeatures) {
  // A roof of two faces over the edge x = 0; their normals are (±1, 0, 1)/√2.
  Points points(4, 3);
  points << 0, 0, 0, 0, 4, 0, -3, 2, -3, 3, 2, -3;
  Triangles triangles(2, 3);
  triangles << 0, 1, 2, 1, 0, 3;
  const SurfaceDistance roof(points, triangles);
  Points queries(3, 3);
  queries << 0.2, 2, 5, 0, -1, 1, 2, 2, 0;
  ClosestPoints closest;
  roof.closest(queries, closest);
  EXPECT_EQ(closest.triangle[0], 0);
  EXPECT_TRUE(closest.weight.row(0).isApprox(Eigen::RowVector3d(0.5, 0.5, 0)));
  EXPECT_TRUE(closest.normal.row(0).isApprox(Eigen::RowVector3d(0, 0, 1)));
  EXPECT_FALSE(closest.on_border[0]);
  EXPECT_EQ(closest.triangle[1], 0);
  EXPECT_TRUE(closest.on_border[1]);
  EXPECT_EQ(closest.triangle[2], 1);
  EXPECT_FALSE(closest.on_border[2]);
  EXPECT_TRUE(closest.normal.row(2).isApprox(Eigen::RowVector3d(1, 0, 1).normalized()));
}

TEST(SurfaceDistance, ThreadsDoNotChangeABit) {
  const auto ball = testing::sphere(10, 3);
  const Points queries = testing::random_points(2000, -15, 15, 4);
  const SurfaceDistance triangles(ball.points, ball.triangles), cloud(ball.points, Triangles(0, 3));
  for (const auto* index : {&triangles, &cloud}) {
    ClosestPoints one, two;
    omp_set_num_threads(1);
    index->closest(queries, one);
    omp_set_num_threads(2);
    index->closest(queries, two);
    EXPECT_TRUE(same_bytes(one.point, two.point) && same_bytes(one.distance_mm, two.distance_mm) &&
                same_bytes(one.triangle, two.triangle) && same_bytes(one.weight, two.weight) &&
                same_bytes(one.normal, two.normal) && same_bytes(one.on_border, two.on_border));
  }
}

TEST(SurfaceDistance, OrderOfQueriesAndOfTrianglesDoesNotMatter) {
  const auto ball = testing::sphere(10, 2);
  const Points queries = testing::random_points(100, -15, 15, 5);
  ClosestPoints closest, backward;
  SurfaceDistance(ball.points, ball.triangles).closest(queries, closest);
  SurfaceDistance(ball.points, ball.triangles.colwise().reverse()).closest(queries.colwise().reverse(), backward);
  EXPECT_TRUE(closest.distance_mm.isApprox(backward.distance_mm.reverse(), 1e-14));
  EXPECT_TRUE(closest.point.isApprox(backward.point.colwise().reverse(), 1e-14));
}

TEST(SurfaceDistance, MovedEqualsBuiltAnew) {
  const auto ball = testing::sphere(10, 2);
  const Points moved = ball.points * 1.3;
  const Points queries = testing::random_points(100, -15, 15, 6);
  SurfaceDistance index(ball.points, ball.triangles);
  index.move(moved);
  ClosestPoints closest, anew;
  index.closest(queries, closest);
  SurfaceDistance(moved, ball.triangles).closest(queries, anew);
  EXPECT_TRUE(same_bytes(closest.point, anew.point) && same_bytes(closest.normal, anew.normal));
}

TEST(SurfaceDistance, ScalesWithTheSurface) {
  const auto ball = testing::sphere(10, 2);
  const Points queries = testing::random_points(100, -15, 15, 7);
  ClosestPoints closest, scaled;
  SurfaceDistance(ball.points, ball.triangles).closest(queries, closest);
  for (const double factor : {1e-3, 1e3}) {
    SurfaceDistance(ball.points * factor, ball.triangles).closest(queries * factor, scaled);
    EXPECT_TRUE(scaled.distance_mm.isApprox(closest.distance_mm * factor, 1e-12));
  }
}

TEST(SurfaceDistance, SkipsTrianglesWithoutAreaAndKeepsTheirNeighbours) {
  Points points(5, 3);
  points << 0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 2, 2, 0;
  Triangles triangles(4, 3);
  triangles << 0, 1, 4, 1, 2, 4, 0, 4, 2, 0, 2, 3;  // the third is flat on the diagonal
  ClosestPoints closest;
  SurfaceDistance(points, triangles).closest(Points(Eigen::RowVector3d(1, 1.0, 3)), closest);
  EXPECT_NEAR(closest.distance_mm[0], 3, 1e-14);
  EXPECT_FALSE(closest.on_border[0]);
}

TEST(PointCloudDistance, ExactOnAPlane) {
  const auto flat = testing::sheet(0, 40, 20);
  Points queries(3, 3);
  queries << 13.3, 17.1, 5, 20, 21, -7, 47, 20, 1;  // the last far beside it
  ClosestPoints closest;
  SurfaceDistance(flat.points, Triangles(0, 3)).closest(queries, closest);
  EXPECT_NEAR(closest.distance_mm[0], 5, 1e-12);
  EXPECT_NEAR(closest.distance_mm[1], 7, 1e-12);
  EXPECT_NEAR(closest.distance_mm[2], std::hypot(7, 1), 1e-12);
  EXPECT_TRUE(closest.point.row(1).isApprox(Eigen::RowVector3d(20, 21, 0), 1e-12));
}

TEST(PointCloudDistance, BorderIsWhereThePointsEnd) {
  auto flat = testing::sheet(0, 40, 20);  // spacing 2, with a hole of radius 9
  std::vector<int> kept;
  for (int i = 0; i < flat.points.rows(); ++i) {
    if ((flat.points.row(i) - Eigen::RowVector3d(20, 20, 0)).norm() > 9) kept.push_back(i);
  }
  const SurfaceDistance cloud(flat.points(kept, Eigen::all), Triangles(0, 3));
  // Inside; one spacing inside the border; on it; outside by less than a spacing; in the hole near its edge; its
  // middle.
  Points queries(6, 3);
  queries << 7.3, 5.1, 4, 38.1, 20.3, 4, 40, 20.3, 4, 40.9, 20.3, 4, 28, 20.3, 4, 20, 20, 4;
  ClosestPoints closest;
  cloud.closest(queries, closest);
  const bool beyond[6] = {false, false, true, true, true, true};
  for (int i = 0; i < 6; ++i) EXPECT_EQ(closest.on_border[i], beyond[i]) << i;
}

TEST(PointCloudDistance, BorderIsTheSameInAnyUnit) {
  const Points flat = testing::sheet(0, 40, 20).points;
  const Points queries = testing::random_points(200, -3, 43, 5);
  for (const double size : {0.01, 100.0}) {
    ClosestPoints here, there;
    SurfaceDistance(flat, Triangles(0, 3)).closest(queries, here);
    SurfaceDistance(Points(size * flat), Triangles(0, 3)).closest(Points(size * queries), there);
    for (int i = 0; i < queries.rows(); ++i) EXPECT_EQ(here.on_border[i], there.on_border[i]) << size << ", " << i;
  }
}

TEST(PointCloudDistance, RowsAlongLinesAreAContourAndPointsSpreadOverASurfaceAreNot) {
  const SurfaceDistance rows(testing::contour(0, 40), Triangles(0, 3));
  EXPECT_TRUE(rows.is_contour());
  EXPECT_TRUE(rows.normals().isZero(0));
  Points queries(2, 3);
  queries << 20, 20, 3, 20, 24, 0;  // over a row, between two
  ClosestPoints closest;
  rows.closest(queries, closest);
  EXPECT_NEAR(closest.distance_mm[0], 3, 1e-12);
  EXPECT_NEAR(closest.distance_mm[1], 4, 1e-12);
  EXPECT_TRUE(closest.on_border.all());
  for (const Points& surface : {testing::sheet(0, 40, 20).points, testing::sphere(30, 3).points})
    EXPECT_FALSE(SurfaceDistance(surface, Triangles(0, 3)).is_contour());
  Points patch = testing::random_points(2000, 0, 40, 3);
  patch.col(2).setZero();
  EXPECT_FALSE(SurfaceDistance(patch, Triangles(0, 3)).is_contour());
  const auto ball = testing::sphere(30, 2);
  EXPECT_FALSE(SurfaceDistance(ball.points, ball.triangles).is_contour());
}

TEST(PointCloudDistance, SphereErrorFallsFasterThanTheSquareOfTheSpacing) {
  Points queries = testing::random_points(200, -1, 1, 8);
  queries.rowwise().normalize();
  queries *= 53;
  double previous = 0;
  for (const int splits : {2, 3, 4}) {
    ClosestPoints closest;
    SurfaceDistance(testing::sphere(50, splits).points, Triangles(0, 3)).closest(queries, closest);
    const double error = (closest.distance_mm.array() - 3).abs().mean();
    if (previous > 0) {
      EXPECT_GT(std::log2(previous / error) + 0.1, 2);
    }
    previous = error;
  }
  EXPECT_LT(previous, 0.02);  // spacing 3.7 mm
}

TEST(SurfaceDistance, RefusesBadSurfaces) {
  const auto ball = testing::sphere(10, 1);
  EXPECT_THROW(SurfaceDistance(ball.points, ball.triangles.array() + 1), InputError);
  EXPECT_THROW(SurfaceDistance(ball.points * std::nan(""), ball.triangles), InputError);
  EXPECT_THROW(SurfaceDistance(ball.points * 0, ball.triangles), InputError);
  EXPECT_THROW(SurfaceDistance(ball.points.topRows(18), Triangles(0, 3)), InputError);
}

}  // namespace supine::calibration
