// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/decimate/decimate.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "reconstruction/reconstruct.h"
#include "reconstruction/surface_check.h"
#include "reconstruction/surface_tree.h"
#include "tests/reconstruction/volumes.h"

namespace supine::meshing {
namespace {

using reconstruction::check_surface;
using reconstruction::Region;
using reconstruction::Surface;
using reconstruction::SurfaceReport;
using segmentation::Tissue;
using testing::ball;
using testing::message_of;

constexpr double volume_bound = 0.005;

Surface dome() {
  return reconstruction::reconstruct(
             testing::voxelise(testing::cubic_grid(Eigen::Vector3d(44, 36, 44), 1.5), testing::dome_on_slab), {})
      .breast.surface;
}

// Everything decimate() promises, measured again from outside.
void expect_promises(const Surface& in, const DecimateResult& result, const DecimateOptions& options) {
  const SurfaceReport before = check_surface(in), after = check_surface(result.surface);
  EXPECT_TRUE(after.closed());
  EXPECT_TRUE(after.manifold());
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(after.components, before.components);
  EXPECT_TRUE(reconstruction::self_intersections(result.surface).empty());
  EXPECT_LT(std::abs(after.volume_mm3 / before.volume_mm3 - 1), volume_bound);
  EXPECT_NEAR(result.volume_change, after.volume_mm3 / before.volume_mm3 - 1, 1e-12);
  const double to = reconstruction::SurfaceTree(in).distances_mm(result.surface.points).maxCoeff();
  const double from = reconstruction::SurfaceTree(result.surface).distances_mm(in.points).maxCoeff();
  EXPECT_LE(std::max(to, from), options.max_distance_mm);
  EXPECT_LE(result.distance_mm, options.max_distance_mm);
  EXPECT_GE(result.distance_mm, std::max(to, from) - 1e-9);
  EXPECT_EQ(result.reached_target, after.triangles <= options.target_triangles);
  EXPECT_EQ(result.reason.empty(), result.reached_target);
}

TEST(Decimate, BallToWellShapedTriangles) {
  const Surface in = ball(40, 5);
  const DecimateOptions options{.target_triangles = 1200, .max_distance_mm = 1};
  const DecimateResult result = decimate(in, options);
  expect_promises(in, result, options);
  EXPECT_TRUE(result.reached_target);
  EXPECT_GE(result.surface.triangles.rows(), 0.85 * options.target_triangles);
  EXPECT_GT(result.smallest_angle_deg, 20);
  EXPECT_EQ(result.surface.region.size(), 0) << "no regions in, none out";
}

TEST(Decimate, RegionsKeepTheirAreaAndTheirBorder) {
  const Surface in = dome();
  const DecimateOptions options{.target_triangles = 1500, .max_distance_mm = 1};
  const DecimateResult result = decimate(in, options);
  expect_promises(in, result, options);
  EXPECT_TRUE(result.reached_target) << result.reason;
  EXPECT_LE(result.border_mm, options.max_distance_mm);
  const SurfaceReport before = check_surface(in), after = check_surface(result.surface);
  for (const Region region : {Region::inner, Region::skin}) {
    const int r = static_cast<int>(region);
    EXPECT_NEAR(after.region_area_mm2[r] / before.region_area_mm2[r], 1, 0.01);
  }
  EXPECT_EQ(after.region_area_mm2[0], 0);
  EXPECT_EQ(after.region_area_mm2[4], 0);
}

TEST(Decimate, TightBoundTakesMoreTrianglesAndSaysSo) {
  const Surface in = ball(40, 5);
  const DecimateOptions options{.target_triangles = 200, .max_distance_mm = 0.1};
  const DecimateResult result = decimate(in, options);
  expect_promises(in, result, options);
  EXPECT_FALSE(result.reached_target);
  EXPECT_NE(result.reason.find("0.1 mm"), std::string::npos) << result.reason;
}

TEST(Decimate, ALooserBoundIsTakenWhereTheNumberNeedsIt) {
  const Surface in = ball(40, 5);
  DecimateOptions options{.target_triangles = 200, .max_distance_mm = 0.1};
  const DecimateResult result = decimate_within(in, {3}, options);
  EXPECT_TRUE(result.reached_target) << result.reason;
  EXPECT_EQ(options.max_distance_mm, 3);
  expect_promises(in, result, options);
  DecimateOptions enough{.target_triangles = 1500, .max_distance_mm = 1};
  const DecimateResult first = decimate(in, enough), same = decimate_within(in, {3}, enough);
  EXPECT_EQ(enough.max_distance_mm, 1) << "what is reached is not loosened";
  EXPECT_EQ(first.surface.points, same.surface.points);
}

TEST(Decimate, AStillLooserBoundIsTakenWhereTheNumberIsTwiceAsLarge) {
  const Surface in = ball(40, 5);
  const DecimateOptions asked{.target_triangles = 200, .max_distance_mm = 0.05};
  DecimateOptions first = asked, second = asked, enough = asked;
  const auto close = decimate_within(in, {0.1}, first).surface.triangles.rows();
  ASSERT_GT(close, 400);
  const DecimateResult result = decimate_within(in, {0.1, 3}, second);
  EXPECT_EQ(second.max_distance_mm, 3);
  EXPECT_TRUE(result.reached_target) << result.reason;
  decimate_within(in, {2, 3}, enough);
  EXPECT_EQ(enough.max_distance_mm, 2) << "what is reached is not loosened further";
}

TEST(Decimate, ABoundThatNoCoarserSurfaceKeepsGivesTheInputBack) {
  const Surface in = ball(40, 4);
  const DecimateResult result = decimate(in, {.target_triangles = 200, .max_distance_mm = 1e-4});
  EXPECT_EQ(result.surface.points, in.points);
  EXPECT_FALSE(result.reached_target);
  EXPECT_NE(result.reason.find("no coarser surface stays within the bound"), std::string::npos) << result.reason;
  EXPECT_NE(result.fallback.find("that the surface has"), std::string::npos) << result.fallback;
}

TEST(Decimate, SmallFeatureIsKeptWhereItIs) {
  // A nipple of 5 mm radius on a dome of 30 mm: edges fit for the dome would cut it off.
  const auto with_nipple = [](const Eigen::Vector3d& at) {
    const double axis = std::hypot(at.x(), at.z());
    return axis < 5 && at.y() < 0 && at.y() > -36 + axis * axis / 10 ? Tissue::skin : testing::dome_on_slab(at);
  };
  const Surface in = reconstruction::reconstruct(
                         testing::voxelise(testing::cubic_grid(Eigen::Vector3d(44, 40, 44), 1), with_nipple), {})
                         .breast.surface;
  const DecimateOptions options{.target_triangles = 600, .max_distance_mm = 0.8};
  const DecimateResult result = decimate(in, options);
  expect_promises(in, result, options);
  EXPECT_LT(result.surface.points.col(1).minCoeff(), -34.5);
}

TEST(Decimate, TurnedAndScaledInputGivesTheSameQuality) {
  const Surface in = dome();
  Surface turned = in;
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  turned.points = 2 * (in.points * rotation.transpose());
  const DecimateResult a = decimate(in, {.target_triangles = 1000, .max_distance_mm = 1});
  const DecimateResult b = decimate(turned, {.target_triangles = 1000, .max_distance_mm = 2});
  expect_promises(turned, b, {.target_triangles = 1000, .max_distance_mm = 2});
  // Rounding decides ties between flips, so meshes differ in places; their figures do not.
  EXPECT_NEAR(static_cast<double>(b.surface.triangles.rows()) / static_cast<double>(a.surface.triangles.rows()), 1,
              0.05);
  EXPECT_NEAR(b.edge_mm / (2 * a.edge_mm), 1, 0.03);
}

TEST(Decimate, SameInputSameBytes) {
  const Surface in = ball(40, 4);
  const DecimateResult a = decimate(in, {.target_triangles = 800}), b = decimate(in, {.target_triangles = 800});
  EXPECT_EQ(a.surface.points, b.surface.points);
  EXPECT_EQ(a.surface.triangles, b.surface.triangles);
}

TEST(Decimate, InputThatIsCoarseEnoughIsReturned) {
  const Surface in = ball(40, 2);
  const DecimateResult result = decimate(in, {.target_triangles = 3000});
  EXPECT_EQ(result.surface.points, in.points);
  EXPECT_TRUE(result.reached_target);
}

TEST(Decimate, QuadsAreNumberedAndMostOfTheFaces) {
  const DecimateResult result = decimate(dome(), {.target_triangles = 1500});
  ASSERT_EQ(result.quad.size(), result.surface.triangles.rows());
  EXPECT_EQ(2 * result.quads + result.alone, result.surface.triangles.rows());
  EXPECT_GT(result.quads, 9 * result.alone) << "at least nine faces of ten are quads";
  EXPECT_LT(result.mean_deviation_deg, 20);
  EXPECT_TRUE(result.fallback.empty());
  std::vector<int> region(result.quads, -1);
  for (Eigen::Index t = 0; t < result.quad.size(); ++t) {
    if (result.quad(t) < 0) continue;
    int& known = region[result.quad(t)];
    if (known < 0) known = result.surface.region(t);
    EXPECT_EQ(result.surface.region(t), known) << "a quad lies in one region";
  }
}

TEST(Decimate, ByFacesAndByEdgeLength) {
  const Surface in = ball(40, 5);
  const DecimateResult faces = decimate(in, {.target_faces = 400});
  EXPECT_NEAR((faces.quads + faces.alone) / 400.0, 1, 0.05);
  const DecimateResult edges = decimate(in, {.edge_mm = 6});
  EXPECT_NEAR(edges.edge_mm / 6, 1, 0.1);
}

TEST(Decimate, TrianglesOfOneSizeWhenAsked) {
  const Surface in = ball(40, 4);
  const DecimateOptions options{.target_triangles = 800, .method = DecimateMethod::triangles};
  const DecimateResult result = decimate(in, options);
  expect_promises(in, result, options);
  EXPECT_EQ(result.quads, 0);
  EXPECT_EQ(result.alone, result.surface.triangles.rows());
}

TEST(Decimate, OpenSurfaceKeepsItsBorderWhenAllowed) {
  Surface in = ball(40, 5);
  std::vector<int> kept;
  for (int t = 0; t < in.triangles.rows(); ++t)
    if (in.points(in.triangles(t, 0), 2) > -20) kept.push_back(t);
  in.triangles = Triangles(in.triangles(kept, Eigen::all));  // points of the rest stay behind, used by none
  const SurfaceReport before = check_surface(in);
  const DecimateResult result = decimate(in, {.target_triangles = 900, .max_distance_mm = 1.5, .open = true});
  const SurfaceReport after = check_surface(result.surface);
  EXPECT_TRUE(after.manifold());
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_GT(after.border_edges, 20);
  // The border zigzags by the triangles of 2 mm that it was cut along.
  EXPECT_LE(result.border_mm, 1.5);
  EXPECT_LE(result.distance_mm, 1.5);
}

// A needle: a new point a thousandth of an edge away from it.
void add_needle(Surface& s, int t) {
  const Eigen::RowVector3d a = s.points.row(s.triangles(t, 0)), b = s.points.row(s.triangles(t, 1)),
                           c = s.points.row(s.triangles(t, 2));
  s.points.conservativeResize(s.points.rows() + 1, 3);
  const auto p = static_cast<int>(s.points.rows()) - 1;
  s.points.row(p) = 0.4995 * a + 0.4995 * b + 0.001 * c;
  const Eigen::RowVector3i old = s.triangles.row(t);
  const Eigen::Index n = s.triangles.rows();
  s.triangles.conservativeResize(n + 2, 3);
  s.triangles.row(t) << old(0), old(1), p;
  s.triangles.row(n) << old(1), old(2), p;
  s.triangles.row(n + 1) << old(2), old(0), p;
}

TEST(Decimate, NeedlesAreDecimatedAway) {
  Surface in = ball(40, 4);
  for (int t = 0; t < 400; t += 7) add_needle(in, t);
  const DecimateOptions options{.target_triangles = 800};
  const DecimateResult result = decimate(in, options);
  expect_promises(in, result, options);
  EXPECT_GT(result.smallest_angle_deg, 10);
}

TEST(Decimate, BrokenSurfacesAreRefusedWithTheirPlace) {
  const Surface good = ball(10, 3);
  const auto refusal = [&good](const std::function<void(Surface&)>& spoil) {
    Surface bad = good;
    spoil(bad);
    return message_of([&bad] { decimate(bad, {.target_triangles = 300}); });
  };
  const auto expect_place = [](const std::string& message, const std::string& kind) {
    EXPECT_NE(message.find(kind), std::string::npos) << message;
    EXPECT_NE(message.find(") mm"), std::string::npos) << message;
  };
  expect_place(refusal([](Surface& s) { s.triangles.row(5).reverseInPlace(); }), "not a manifold");
  expect_place(refusal([](Surface& s) {
                 s.triangles.conservativeResize(s.triangles.rows() + 1, 3);
                 s.triangles.row(s.triangles.rows() - 1) = s.triangles.row(7);
               }),
               "not a manifold");
  expect_place(refusal([](Surface& s) {
                 // Two sheets that touch in one point.
                 const int p = s.triangles(0, 0);
                 for (Eigen::Index t = s.triangles.rows() - 1; t > 0; --t)
                   if ((s.points.row(s.triangles(t, 0)) + s.points.row(p)).norm() < 1e-6) {
                     const int other = s.triangles(t, 0);
                     for (Eigen::Index i = 0; i < s.triangles.size(); ++i)
                       if (s.triangles.data()[i] == other) s.triangles.data()[i] = p;
                     break;
                   }
               }),
               "not a manifold");
  expect_place(refusal([](Surface& s) { s.triangles.conservativeResize(s.triangles.rows() - 3, 3); }), "not closed");
  expect_place(refusal([](Surface& s) { s.points.row(0) *= -1.5; }), "intersects itself");
  EXPECT_NE(refusal([](Surface& s) { s.triangles.col(1).swap(s.triangles.col(2)); }).find("face inward"),
            std::string::npos);
  EXPECT_NE(refusal([](Surface& s) { s.triangles.resize(0, 3); }).find("no triangles"), std::string::npos);
}

TEST(Decimate, RefusesOpenAndCrossingSurfacesAndOptionsOutOfRange) {
  Surface open = ball(10, 3);
  open.triangles.conservativeResize(open.triangles.rows() - 1, 3);
  EXPECT_NE(message_of([&] { decimate(open, {}); }).find("not closed"), std::string::npos);
  Surface crossing = ball(10, 3);
  crossing.points.row(0) *= -1.5;
  EXPECT_NE(message_of([&] { decimate(crossing, {}); }).find("intersects itself"), std::string::npos);
  EXPECT_NE(message_of([] { decimate(ball(10, 3), {.target_triangles = 3}); }).find("at least 100"), std::string::npos);
  EXPECT_NE(message_of([] { decimate(ball(10, 3), {.max_distance_mm = 0}); }).find("must be > 0"), std::string::npos);
  EXPECT_NE(message_of([] { decimate(ball(10, 3), {.target_faces = 7}); }).find("at least 50"), std::string::npos);
  EXPECT_NE(message_of([] { decimate(ball(10, 3), {.edge_mm = -1}); }).find("must be > 0"), std::string::npos);
  EXPECT_NE(message_of([] { decimate(ball(10, 3), {.relative_size = Eigen::VectorXd::Ones(3)}); }).find("one each"),
            std::string::npos);
  EXPECT_NE(message_of([] {
              decimate(ball(10, 3), {.relative_size = Eigen::VectorXd::Zero(ball(10, 3).points.rows())});
            }).find("must lie in"),
            std::string::npos);
}

}  // namespace
}  // namespace supine::meshing
