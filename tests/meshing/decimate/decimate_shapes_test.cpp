// SPDX-License-Identifier: AGPL-3.0-or-later
// What decimation keeps, whatever the shape: pieces, handles, open borders, region borders, and that nothing crosses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "meshing/decimate/decimate.h"
#include "meshing/surface/triangle_tree.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"
#include "tests/meshing/surface_shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::check_surface;
using reconstruction::MeshEdge;
using reconstruction::Surface;
using reconstruction::SurfaceReport;
using testing::grid;
using testing::inside_out;
using testing::lump;
using testing::moved_by;
using testing::together;
using testing::torus;
using testing::voxels;

struct Shape {
  std::string name;
  Surface surface;
  int genus = 0;    // of closed ones
  int borders = 0;  // open ones
  int triangles = 500;
  double bound_mm = 1.5;
};

void PrintTo(const Shape& shape, std::ostream* out) { *out << shape.name; }

Surface voxel_ball(double radius) {
  const int n = static_cast<int>(2 * radius + 2);
  return voxels(n, n, n, 1, [=](int x, int y, int z) {
    return (Eigen::Vector3d(x, y, z).array() - 0.5 * (n - 1)).matrix().norm() < radius;
  });
}

std::vector<Shape> shapes() {
  const auto wave = [](double u, double v) {
    return Eigen::Vector3d(60 * u, 50 * v, 6 * std::sin(3 * u) * std::cos(4 * v));
  };
  const auto tube = [](double u, double v) {
    const double a = 2 * std::numbers::pi * u;
    return Eigen::Vector3d((15 + 5 * v) * std::cos(a), (15 + 3 * v) * std::sin(a), 50 * v);
  };
  const auto ring = [](double u, double v) {
    const double a = 2 * std::numbers::pi * u, r = 12 + 25 * v;
    return Eigen::Vector3d(r * std::cos(a), r * std::sin(a), 4 * std::sin(2 * a) * v);
  };
  const auto block = [](int x, int y, int z) {
    if (y > 4 && y < 13 && ((x > 5 && x < 13) || (x > 18 && x < 26))) return false;
    return z < 4 + x / 8;
  };
  const auto cap = [](int x, int y, int z) {
    const double r = Eigen::Vector3d(x - 19.5, y - 19.5, z + 25.5).norm();
    return r < 37 && r > 34.5;
  };
  return {
      {"lump", lump()},
      {"ball_of_voxels", voxel_ball(14)},
      {"torus", torus(30, 12), 1},
      {"thin_torus", torus(30, 3), 1, 0, 800},
      {"block_with_two_holes_and_steps", voxels(32, 18, 8, 1, block), 2, 0, 900},
      {"cavity", together(voxel_ball(14), moved_by(inside_out(voxel_ball(6)), {8, 8, 8})), 0, 0, 700},
      {"two_bodies", together(voxel_ball(12), moved_by(lump(), {40, 0, 0})), 0, 0, 900},
      {"plate_one_voxel_thick", voxels(20, 16, 1, 1, [](int, int, int) { return true; }), 0, 0, 300},
      {"cap_two_voxels_thick", voxels(40, 40, 14, 1, cap), 0, 0, 900},
      {"slit_one_voxel_wide", voxels(24, 20, 16, 1, [](int x, int, int z) { return x != 11 || z < 3; }), 0, 0, 700},
      {"finger", voxels(3, 4, 60, 1, [](int, int, int) { return true; }), 0, 0, 400},
      {"staircase", voxels(14, 8, 14, 1, [](int x, int, int z) { return z <= x; }), 0, 0, 400, 2},
      {"open_sheet", grid(50, 40, false, false, wave), 0, 1},
      {"open_tube", grid(60, 40, true, false, tube), 0, 2},
      {"open_ring", grid(80, 24, true, false, ring), 0, 2},
  };
}

Surface turned_and_scaled(Surface s, double factor) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  s.points = factor * (s.points * turn.transpose());
  return s;
}

// Three regions that meet in points, by where the triangles are.
void add_regions(Surface& s) {
  const Eigen::RowVector3d middle = s.points.colwise().mean();
  s.region.resize(s.triangles.rows());
  for (Eigen::Index t = 0; t < s.triangles.rows(); ++t) {
    Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
    for (int c = 0; c < 3; ++c) centre += s.points.row(s.triangles(t, c)) / 3;
    s.region(t) = centre.x() < middle.x() ? 1 : centre.y() < middle.y() ? 2 : 4;
  }
}

int open_borders(const Surface& s) {
  std::map<int, std::vector<int>> next;
  for (const MeshEdge& edge : reconstruction::mesh_edges(s.triangles))
    if (edge.count == 1)
      for (int i = 0; i < 2; ++i) next[edge.points[i]].push_back(edge.points[1 - i]);
  int loops = 0;
  while (!next.empty()) {
    ++loops;
    std::vector<int> stack{next.begin()->first};
    while (!stack.empty()) {
      const int p = stack.back();
      stack.pop_back();
      const auto found = next.find(p);
      if (found == next.end()) continue;
      stack.insert(stack.end(), found->second.begin(), found->second.end());
      next.erase(found);
    }
  }
  return loops;
}

Surface of_region(const Surface& s, int region) {
  std::vector<int> kept;
  for (int t = 0; t < s.triangles.rows(); ++t)
    if (s.region(t) == region) kept.push_back(t);
  return {s.points, Triangles(s.triangles(kept, Eigen::all)), {}};
}

void expect_kept(const Surface& in, const DecimateResult& result, double bound_mm) {
  const Surface& out = result.surface;
  const SurfaceReport before = check_surface(in), after = check_surface(out);
  EXPECT_TRUE(after.manifold());
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.cavities, before.cavities);
  EXPECT_EQ(open_borders(out), open_borders(in));
  EXPECT_TRUE(reconstruction::self_intersections(out).empty());
  EXPECT_LT(out.triangles.rows(), in.triangles.rows());
  EXPECT_LE(TriangleTree(in.points, in.triangles).distances_mm(out.points).maxCoeff(), bound_mm);
  EXPECT_LE(TriangleTree(out.points, out.triangles).distances_mm(in.points).maxCoeff(), bound_mm);
}

DecimateOptions options_for(const Shape& shape, double factor) {
  return {.target_triangles = shape.triangles, .max_distance_mm = factor * shape.bound_mm, .open = shape.borders > 0};
}

class Shapes : public ::testing::TestWithParam<Shape> {};

TEST_P(Shapes, KeepTopology) {
  const Shape& shape = GetParam();
  const SurfaceReport report = check_surface(shape.surface);
  ASSERT_TRUE(report.manifold());
  ASSERT_EQ(open_borders(shape.surface), shape.borders);
  if (report.closed()) {
    ASSERT_EQ(report.genus(), shape.genus);
  }
  const DecimateResult result = decimate(shape.surface, options_for(shape, 1));
  expect_kept(shape.surface, result, shape.bound_mm);
  EXPECT_TRUE(result.fallback.empty()) << result.fallback;
}

class SomeShapes : public ::testing::TestWithParam<Shape> {};

TEST_P(SomeShapes, AreDecimatedAlikeWhenTurnedAndScaled) {
  const Shape& shape = GetParam();
  const DecimateResult result = decimate(shape.surface, options_for(shape, 1));
  const Surface other = turned_and_scaled(shape.surface, 100);
  const DecimateResult again = decimate(other, options_for(shape, 100));
  expect_kept(other, again, 100 * shape.bound_mm);
  const auto count = static_cast<double>(result.surface.triangles.rows());
  EXPECT_NEAR(static_cast<double>(again.surface.triangles.rows()) / count, 1, 0.05);
  EXPECT_NEAR(again.mean_from_input_mm / 100, result.mean_from_input_mm, 0.2 * result.mean_from_input_mm + 1e-3);
}

TEST_P(SomeShapes, KeepTheirRegions) {
  const Shape& shape = GetParam();
  Surface in = shape.surface;
  add_regions(in);
  DecimateOptions options = options_for(shape, 1);
  options.max_distance_mm *= 2;
  const DecimateResult result = decimate(in, options);
  expect_kept(in, result, options.max_distance_mm);
  ASSERT_EQ(result.surface.region.size(), result.surface.triangles.rows());
  for (const int region : {1, 2, 4}) {
    const Surface before = of_region(in, region), after = of_region(result.surface, region);
    EXPECT_EQ(check_surface(after).components, check_surface(before).components) << region;
    EXPECT_EQ(check_surface(after).euler, check_surface(before).euler) << region;
    EXPECT_EQ(open_borders(after), open_borders(before)) << region;
  }
  EXPECT_LE(result.border_mm, options.max_distance_mm);
}

std::vector<Shape> some_shapes() {
  std::vector<Shape> some;
  for (const Shape& shape : shapes())
    if (shape.name == "lump" || shape.name == "block_with_two_holes_and_steps") some.push_back(shape);
  return some;
}

INSTANTIATE_TEST_SUITE_P(Decimate, Shapes, ::testing::ValuesIn(shapes()),
                         [](const auto& test) { return test.param.name; });
INSTANTIATE_TEST_SUITE_P(Decimate, SomeShapes, ::testing::ValuesIn(some_shapes()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace supine::meshing
