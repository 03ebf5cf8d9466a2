// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/quad_remesh.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <tuple>

#include "meshing/surface/triangle_tree.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"
#include "tests/meshing/surface_shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::check_surface;
using reconstruction::Surface;
using reconstruction::SurfaceReport;
using testing::grid;
using testing::lump;
using testing::torus;
using testing::voxels;

QuadMesh remeshed(const Surface& in, const QuadTarget& target) {
  const int triangles = target.triangles > 0 ? target.triangles : 2 * target.faces;
  QuadRemesher remesher(in, {}, target.edge_mm > 0 ? target.edge_mm : edge_for_triangles(in, {}, triangles));
  return remesher.make(target);
}

void expect_topology(const Surface& in, const Surface& out) {
  const SurfaceReport before = check_surface(in), after = check_surface(out);
  EXPECT_TRUE(after.manifold());
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.closed(), before.closed());
}

double largest_distance(const Surface& in, const Surface& out) {
  return std::max(TriangleTree(in.points, in.triangles).distances_mm(out.points).maxCoeff(),
                  TriangleTree(out.points, out.triangles).distances_mm(in.points).maxCoeff());
}

TEST(QuadRemesh, KeepsGenusOneAndHitsTheNumberOfFaces) {
  const Surface in = torus(30, 12);
  for (const int faces : {150, 400}) {
    const QuadMesh out = remeshed(in, {.faces = faces});
    expect_topology(in, out.surface);
    EXPECT_EQ(check_surface(out.surface).genus(), 1);
    EXPECT_TRUE(reconstruction::self_intersections(out.surface).empty());
    EXPECT_NEAR(static_cast<double>(out.pairs.faces()) / faces, 1, 0.1);
    EXPECT_GT(out.pairs.quads, 0.9 * out.pairs.faces());
    // One and a half times the height of a chord over the tube, for edges of sqrt(area / faces).
    const double edge_squared = check_surface(in).area_mm2 / faces;
    EXPECT_LT(largest_distance(in, out.surface), 1.5 * edge_squared / (8 * 12));
  }
}

TEST(QuadRemesh, KeepsGenusTwoOfAStaircase) {
  // A block with two holes through it, and steps along one side.
  const Surface in = voxels(32, 18, 8, 1, [](int x, int y, int z) {
    if (y > 4 && y < 13 && ((x > 5 && x < 13) || (x > 18 && x < 26))) return false;
    return z < 4 + x / 8;
  });
  ASSERT_EQ(check_surface(in).genus(), 2);
  const QuadMesh out = remeshed(in, {.triangles = 900});
  expect_topology(in, out.surface);
  EXPECT_TRUE(reconstruction::self_intersections(out.surface).empty());
  EXPECT_LE(out.surface.triangles.rows(), 900);
}

TEST(QuadRemesh, OpenBordersStayOnTheirPlace) {
  const Surface in = grid(60, 50, false, false, [](double u, double v) {
    return Eigen::Vector3d(60 * u, 50 * v, 6 * std::sin(3 * u) * std::cos(4 * v));
  });
  const QuadMesh out = remeshed(in, {.edge_mm = 4});
  expect_topology(in, out.surface);
  EXPECT_GT(out.pairs.quads, 0.9 * out.pairs.faces());
  EXPECT_LT(largest_distance(in, out.surface), 0.4);
  for (const auto& edge : reconstruction::mesh_edges(out.surface.triangles)) {
    if (edge.count != 1) continue;
    for (const int p : edge.points) {
      const Eigen::RowVector3d at = out.surface.points.row(p);
      const double away = std::min({at.x(), at.y(), 60 - at.x(), 50 - at.y()});
      EXPECT_NEAR(away, 0, 0.05);
    }
  }
}

TEST(QuadRemesh, FlatGridBecomesSquares) {
  const Surface in = grid(40, 40, false, false, [](double u, double v) { return Eigen::Vector3d(40 * u, 40 * v, 0); });
  const QuadMesh out = remeshed(in, {.edge_mm = 4});
  EXPECT_EQ(out.pairs.alone, 0);
  EXPECT_EQ(out.pairs.quads, 100);
  EXPECT_LT(quad_deviations_deg(out.surface, out.pairs).maxCoeff(), 5);
}

TEST(QuadRemesh, ThinShellStaysTwoSheets) {
  // A cap of 2 mm thickness and edges of 5 mm.
  const Surface in = voxels(40, 40, 14, 1, [](int x, int y, int z) {
    const double r = Eigen::Vector3d(x - 19.5, y - 19.5, z + 25.5).norm();
    return r < 37 && r > 34.5;
  });
  const SurfaceReport before = check_surface(in);
  ASSERT_TRUE(before.manifold() && before.closed());
  const QuadMesh out = remeshed(in, {.triangles = 600});
  expect_topology(in, out.surface);
}

TEST(QuadRemesh, SizesAreFollowed) {
  const Surface in = torus(30, 12);
  Eigen::VectorXd sizes(in.points.rows());
  for (Eigen::Index p = 0; p < sizes.size(); ++p) sizes(p) = in.points(p, 0) > 0 ? 0.5 : 1;
  QuadRemesher remesher(in, sizes, edge_for_triangles(in, sizes, 1500));
  const QuadMesh out = remesher.make({.triangles = 1500});
  expect_topology(in, out.surface);
  int fine = 0, coarse = 0;
  for (Eigen::Index t = 0; t < out.surface.triangles.rows(); ++t)
    (out.surface.points(out.surface.triangles(t, 0), 0) > 0 ? fine : coarse) += 1;
  EXPECT_GT(fine, 3 * coarse) << "half the edge length is four times the triangles";
  EXPECT_LT(fine, 5.5 * coarse);
}

TEST(QuadRemesh, SameBytesForAnyNumberOfThreads) {
  const Surface in = torus(30, 12);
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const QuadMesh one = remeshed(in, {.triangles = 700});
  omp_set_num_threads(3);
  const QuadMesh three = remeshed(in, {.triangles = 700});
  omp_set_num_threads(before);
  EXPECT_EQ(one.surface.points, three.surface.points);
  EXPECT_EQ(one.surface.triangles, three.surface.triangles);
  EXPECT_EQ(one.pairs.quad, three.pairs.quad);
}

TEST(QuadRemesh, TurnedAndScaledInputGivesTheTurnedAndScaledResult) {
  const Surface in = lump();
  Surface turned = in;
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  turned.points = 1000 * (in.points * rotation.transpose());
  int same = 0;
  for (const int triangles : {500, 600, 650, 700, 750}) {
    const QuadMesh a = remeshed(in, {.triangles = triangles}), b = remeshed(turned, {.triangles = triangles});
    ASSERT_EQ(a.surface.points.rows(), b.surface.points.rows());
    const auto differ = (a.surface.triangles.array() != b.surface.triangles.array()).rowwise().any().count();
    EXPECT_LE(differ, 2) << "one diagonal that two choices were equally good for";
    // A hundred sweeps and a fit let rounding grow to a thousandth of an edge (3 to 4 m here).
    const auto away = (1000 * (a.surface.points * rotation.transpose()) - b.surface.points).rowwise().norm().eval();
    EXPECT_LT(away.mean(), 5);
    EXPECT_LT(away.maxCoeff(), 2000) << "half an edge, beside the diagonal";
    if (differ == 0 && away.maxCoeff() < 5) ++same;
  }
  EXPECT_GE(same, 4);
}

TEST(QuadPairs, EachTriangleIsInOneQuadOrAloneAndQuadsKeepTheirAngles) {
  const Surface surface = remeshed(torus(30, 12), {.faces = 300}).surface;
  const QuadPairs pairs = pair_triangles(surface);
  std::vector<int> uses(pairs.quads, 0);
  int alone = 0;
  for (const int quad : pairs.quad) quad < 0 ? ++alone : ++uses[quad];
  EXPECT_EQ(alone, pairs.alone);
  for (const int n : uses) EXPECT_EQ(n, 2);
  EXPECT_LE(quad_deviations_deg(surface, pairs).maxCoeff(), 60);
}

TEST(TriangleTree, ClosestPointsAreThoseOfASearchThroughAll) {
  const Surface s = torus(30, 12);
  const TriangleTree tree(s.points, s.triangles);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d at(40 * std::sin(1.3 * i), 37 * std::cos(2.1 * i), 20 * std::sin(0.7 * i + 1));
    double nearest = 1e300;
    for (Eigen::Index t = 0; t < s.triangles.rows(); ++t) {
      const std::array<Eigen::Vector3d, 3> abc = {s.points.row(s.triangles(t, 0)).transpose(),
                                                  s.points.row(s.triangles(t, 1)).transpose(),
                                                  s.points.row(s.triangles(t, 2)).transpose()};
      const Eigen::Vector3d w = closest_weights(at, abc);
      nearest = std::min(nearest, (w[0] * abc[0] + w[1] * abc[1] + w[2] * abc[2] - at).norm());
    }
    const TriangleTree::Hit hit = tree.closest(at);
    EXPECT_NEAR(std::sqrt(hit.squared_mm2), nearest, 1e-12);
    EXPECT_NEAR((hit.point - at).norm(), nearest, 1e-12);
    EXPECT_NEAR(hit.weights.sum(), 1, 1e-12);
  }
}

}  // namespace
}  // namespace supine::meshing
