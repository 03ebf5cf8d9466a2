// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/surface_check.h"

#include <gtest/gtest.h>

#include <numbers>

#include "reconstruction/surface_tree.h"
#include "tests/reconstruction/volumes.h"

namespace supine::reconstruction {
namespace {

using testing::ball;
using testing::message_of;

Surface both(const Surface& a, const Surface& b) {
  Surface sum;
  sum.points.resize(a.points.rows() + b.points.rows(), 3);
  sum.points << a.points, b.points;
  sum.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  sum.triangles << a.triangles, (b.triangles.array() + static_cast<int>(a.points.rows())).matrix();
  return sum;
}

TEST(SurfaceCheck, BallIsClosedManifoldOfGenusZero) {
  const SurfaceReport report = check_surface(ball(10, 3));
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.manifold());
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.euler, 2);
  EXPECT_EQ(report.genus(), 0);
  EXPECT_EQ(report.triangles, 20 * 64);
  // Chords of an inscribed polyhedron: below the ball by less than 1 %.
  EXPECT_NEAR(report.volume_mm3 / (4.0 / 3 * std::numbers::pi * 1000), 0.995, 0.005);
  EXPECT_NEAR(report.area_mm2 / (4 * std::numbers::pi * 100), 0.9965, 0.0035);
}

TEST(SurfaceCheck, HoleDoubleEdgeAndPinchedPointAreCounted) {
  Surface open = ball(10, 1);
  open.triangles.conservativeResize(open.triangles.rows() - 1, 3);
  EXPECT_EQ(check_surface(open).border_edges, 3);
  EXPECT_FALSE(check_surface(open).closed());
  EXPECT_TRUE(check_surface(open).manifold());

  Surface turned = ball(10, 1);
  std::swap(turned.triangles(5, 0), turned.triangles(5, 1));
  EXPECT_EQ(check_surface(turned).bad_edges, 3);

  Surface pinched = both(ball(10, 0), ball(10, 0));
  pinched.points.bottomRows(12).col(0).array() += 30;
  for (Eigen::Index i = 0; i < pinched.triangles.size(); ++i)
    if (pinched.triangles.data()[i] == 12) pinched.triangles.data()[i] = 0;
  const SurfaceReport report = check_surface(pinched);
  EXPECT_EQ(report.bad_points, 1);
  EXPECT_EQ(report.bad_edges, 0);
  EXPECT_EQ(report.first_bad_point, 0);
}

TEST(SurfaceCheck, CavityCountsAsACavity) {
  Surface inner = ball(5, 2);
  inner.triangles.col(0).swap(inner.triangles.col(1));
  const SurfaceReport report = check_surface(both(ball(10, 2), inner));
  EXPECT_EQ(report.components, 2);
  EXPECT_EQ(report.cavities, 1);
  EXPECT_NEAR(report.volume_mm3, 7.0 / 8 * check_surface(ball(10, 2)).volume_mm3, 1e-6);
}

TEST(SurfaceCheck, CrossingsAreFoundAndTouchingNeighboursAreNot) {
  EXPECT_TRUE(self_intersections(ball(10, 2)).empty());
  Surface second = ball(10, 2);
  second.points.col(0).array() += 15;
  EXPECT_FALSE(self_intersections(both(ball(10, 2), second)).empty());
}

TEST(SurfaceCheck, RequireSolidNamesFaultAndPlace) {
  EXPECT_NO_THROW(require_solid(ball(10, 2), "ball"));
  Surface open = ball(10, 1);
  open.triangles.conservativeResize(open.triangles.rows() - 1, 3);
  EXPECT_NE(message_of([&] { require_solid(open, "the file"); }).find("the file: not closed"), std::string::npos);
  Surface inward = ball(10, 1);
  inward.triangles.col(0).swap(inward.triangles.col(1));
  EXPECT_NE(message_of([&] { require_solid(inward, "x"); }).find("face inward"), std::string::npos);
  Surface second = ball(10, 2);
  second.points.col(0).array() += 15;
  const std::string crossing = message_of([&] { require_solid(both(ball(10, 2), second), "x"); });
  EXPECT_NE(crossing.find("intersects itself"), std::string::npos);
  EXPECT_NE(crossing.find(" mm"), std::string::npos);
  Surface turned = ball(10, 1);
  std::swap(turned.triangles(5, 0), turned.triangles(5, 1));
  EXPECT_NE(message_of([&] { require_solid(turned, "x"); }).find("not a manifold"), std::string::npos);
  EXPECT_NE(message_of([] { require_solid({}, "x"); }).find("no triangles"), std::string::npos);
}

TEST(SurfaceTree, DistancesToABall) {
  const SurfaceTree tree(ball(10, 5));
  Points at(3, 3);
  at << 20, 0, 0, 0, 0, 0, 0, -7, 0;
  const Eigen::VectorXd d = tree.distances_mm(at);
  // The inscribed polyhedron lies less than 0.01 mm inside the ball.
  EXPECT_NEAR(d(0), 10, 0.01);
  EXPECT_NEAR(d(1), 10, 0.01);
  EXPECT_NEAR(d(2), 3, 0.01);
}

}  // namespace
}  // namespace supine::reconstruction
