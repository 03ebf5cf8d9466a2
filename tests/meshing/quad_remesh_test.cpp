// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quad_remesh.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <tuple>

#include "meshing/triangle_tree.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"

namespace supine::meshing {
namespace {

using reconstruction::check_surface;
using reconstruction::Surface;
using reconstruction::SurfaceReport;

using Map = std::function<Eigen::Vector3d(double, double)>;

// A grid of nu × nv cells over [0, 1]², each cut in two; wrapped where it closes.
Surface grid(int nu, int nv, bool wrap_u, bool wrap_v, const Map& map) {
  const int pu = wrap_u ? nu : nu + 1, pv = wrap_v ? nv : nv + 1;
  Surface s;
  s.points.resize(pu * pv, 3);
  for (int i = 0; i < pu; ++i)
    for (int j = 0; j < pv; ++j)
      s.points.row(i * pv + j) = map(static_cast<double>(i) / nu, static_cast<double>(j) / nv).transpose();
  s.triangles.resize(2 * nu * nv, 3);
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const int a = i * pv + j, b = (i + 1) % pu * pv + j, c = (i + 1) % pu * pv + (j + 1) % pv,
                d = i * pv + (j + 1) % pv;
      s.triangles.row(2 * (i * nv + j)) << a, b, c;
      s.triangles.row(2 * (i * nv + j) + 1) << a, c, d;
    }
  return s;
}

Surface torus(double ring_mm, double tube_mm) {
  return grid(96, 40, true, true, [=](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
    const double r = ring_mm + tube_mm * std::cos(b);
    return Eigen::Vector3d(r * std::cos(a), r * std::sin(a), tube_mm * std::sin(b));
  });
}

// Boundary of a set of voxels; every step stays a step.
Surface voxels(int nx, int ny, int nz, double voxel_mm, const std::function<bool(int, int, int)>& inside) {
  std::map<std::tuple<int, int, int>, int> numbers;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3i> triangles;
  const auto at = [&](int x, int y, int z) {
    const auto [entry, fresh] = numbers.emplace(std::tuple(x, y, z), static_cast<int>(points.size()));
    if (fresh) points.emplace_back(voxel_mm * x, voxel_mm * y, voxel_mm * z);
    return entry->second;
  };
  const auto filled = [&](int x, int y, int z) {
    return x >= 0 && y >= 0 && z >= 0 && x < nx && y < ny && z < nz && inside(x, y, z);
  };
  for (int x = 0; x < nx; ++x)
    for (int y = 0; y < ny; ++y)
      for (int z = 0; z < nz; ++z) {
        if (!filled(x, y, z)) continue;
        for (int axis = 0; axis < 3; ++axis)
          for (const int side : {0, 1}) {
            Eigen::Vector3i n = Eigen::Vector3i::Zero();
            n[axis] = side ? 1 : -1;
            if (filled(x + n[0], y + n[1], z + n[2])) continue;
            Eigen::Vector3i u = Eigen::Vector3i::Zero(), v = u, base(x, y, z);
            u[(axis + 1) % 3] = 1;
            v[(axis + 2) % 3] = 1;
            if (side) base[axis] += 1;
            const auto corner = [&](const Eigen::Vector3i& p) { return at(p[0], p[1], p[2]); };
            int a = corner(base), b = corner(base + u), c = corner(base + u + v), d = corner(base + v);
            if (!side) std::swap(b, d);
            triangles.emplace_back(a, b, c);
            triangles.emplace_back(a, c, d);
          }
      }
  Surface s;
  s.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  s.triangles.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) s.points.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  for (std::size_t i = 0; i < triangles.size(); ++i)
    s.triangles.row(static_cast<Eigen::Index>(i)) = triangles[i].transpose();
  return s;
}

// An ellipsoid with uneven bumps: nothing about it is symmetric.
Surface lump() {
  Surface s = voxels(24, 20, 18, 2, [](int x, int y, int z) {
    const Eigen::Vector3d at(x - 11.6, y - 9.3, z - 8.4);
    return at.cwiseQuotient(Eigen::Vector3d(11, 8.6, 7.7)).squaredNorm() < 1;
  });
  const auto neighbours = reconstruction::point_neighbours(reconstruction::mesh_edges(s.triangles), s.points.rows());
  for (int round = 0; round < 12; ++round) {
    Points next = s.points;
    for (Eigen::Index p = 0; p < next.rows(); ++p) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (const int q : neighbours[p]) sum += s.points.row(q);
      next.row(p) = sum / static_cast<double>(neighbours[p].size());
    }
    s.points = next;
  }
  for (Eigen::Index p = 0; p < s.points.rows(); ++p) {
    const Eigen::RowVector3d at = s.points.row(p);
    s.points.row(p) +=
        0.8 * Eigen::RowVector3d(std::sin(0.31 * at.y() + 0.2), std::cos(0.23 * at.z()), std::sin(0.17 * at.x() + 1));
  }
  return s;
}

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
    EXPECT_GT(out.pairs.quad_share(), 0.9);
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
  EXPECT_GT(out.pairs.quad_share(), 0.9);
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
  const QuadMesh a = remeshed(in, {.triangles = 700}), b = remeshed(turned, {.triangles = 700});
  ASSERT_EQ(a.surface.points.rows(), b.surface.points.rows());
  EXPECT_EQ(a.surface.triangles, b.surface.triangles);
  // A hundred sweeps and a fit let rounding grow to less than a thousandth of an edge (5 m here).
  EXPECT_LT((1000 * (a.surface.points * rotation.transpose()) - b.surface.points).rowwise().norm().maxCoeff(), 5);
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
