// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/crossings.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <random>

#include "meshing/region_mesh.h"
#include "meshing/sound_surface.h"
#include "tests/meshing/surface_shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::self_intersections;
using reconstruction::Surface;
using testing::grid;
using testing::lump;
using testing::moved_by;
using testing::together;
using testing::torus;
using testing::voxels;

using Pairs = std::vector<std::pair<int, int>>;

Pairs crossings(const Surface& s) { return meshing::crossings(s, TriangleTree(s.points, s.triangles)); }

Surface shaken(Surface s, double by_mm, unsigned seed) {
  std::mt19937 random(seed);
  for (Eigen::Index i = 0; i < s.points.size(); ++i)
    s.points.data()[i] += by_mm * (2.0 * static_cast<double>(random()) / std::mt19937::max() - 1);
  return s;
}

Surface box() {
  return voxels(4, 4, 4, 1, [](int, int, int) { return true; });
}

Surface open_sheet() {
  return grid(12, 9, false, false, [](double u, double v) { return Eigen::Vector3d(12 * u, 9 * v, 0); });
}

// Two triangles over the edge from (0, 0, 0) to (1, 0, 0), then two that share one corner only.
Surface hinge(const Eigen::RowVector3d& apex) {
  Surface s;
  s.points.resize(4, 3);
  s.points << 0, 0, 0, 1, 0, 0, 0.4, 1, 0, apex;
  s.triangles.resize(2, 3);
  s.triangles << 0, 1, 2, 1, 0, 3;
  return s;
}

Surface corner(const Eigen::RowVector3d& c, const Eigen::RowVector3d& d) {
  Surface s;
  s.points.resize(5, 3);
  s.points << 0, 0, 0, 1, 0, 0, 0, 1, 0, c, d;
  s.triangles.resize(2, 3);
  s.triangles << 0, 1, 2, 0, 3, 4;
  return s;
}

TEST(Crossings, AreThoseOfTheExactPredicatesOnShakenSurfaces) {
  std::size_t all = 0;
  for (const Surface& shape : {lump(), torus(30, 12), box(), open_sheet()})
    for (const double by_mm : {0.0, 1e-15, 1e-9, 0.3, 1.5, 6.0})
      for (const unsigned seed : {1U, 2U}) {
        const Surface s = shaken(shape, by_mm, seed);
        const Pairs wanted = self_intersections(s);
        EXPECT_EQ(crossings(s), wanted) << by_mm;
        all += wanted.size();
      }
  EXPECT_GT(all, 10000U);  // so that there was something to find
}

TEST(Crossings, TouchingBodiesAreFoundAsTheExactPredicatesFindThem) {
  // Face on face, edge on edge, corner on corner, corner in a face, and apart by the last bit.
  for (const Eigen::RowVector3d& shift :
       {Eigen::RowVector3d(4, 0, 0), Eigen::RowVector3d(4, 4, 0), Eigen::RowVector3d(4, 4, 4),
        Eigen::RowVector3d(4, 0.3, 0.2), Eigen::RowVector3d(3.999999, 0.5, 0.5),
        Eigen::RowVector3d(std::nextafter(4.0, 5.0), 0, 0), Eigen::RowVector3d(0, 0, 0)}) {
    const Surface s = together(box(), moved_by(box(), shift));
    EXPECT_EQ(crossings(s), self_intersections(s)) << shift;
  }
  EXPECT_FALSE(crossings(together(box(), moved_by(box(), {4, 4, 4}))).empty());
  EXPECT_TRUE(crossings(together(box(), moved_by(box(), {std::nextafter(4.0, 5.0), 0, 0}))).empty());
}

TEST(Crossings, FoldsOverASharedEdgeOrCorner) {
  const Pairs one = {{0, 1}};
  EXPECT_EQ(crossings(hinge({0.5, 0.7, 0})), one);          // folded flat onto the other
  EXPECT_TRUE(crossings(hinge({0.5, 0.7, 1e-9})).empty());  // nearly so
  EXPECT_TRUE(crossings(hinge({0.5, -0.7, 0})).empty());
  EXPECT_EQ(crossings(corner({0.5, 0.5, 0.5}, {0.5, 0.4, -0.5})), one);  // through the other
  EXPECT_EQ(crossings(corner({2, 0.5, 0}, {0.5, 2, 0})), one);           // in its plane, over it
  EXPECT_TRUE(crossings(corner({-1, -0.1, 0}, {-0.1, -1, 0})).empty());
  EXPECT_TRUE(crossings(corner({1, -1e-6, 0}, {0, -1, 0})).empty());  // a narrow gap in one plane
  EXPECT_TRUE(crossings(corner({0.5, 0.5, 1}, {0.5, 0.4, 1e-6})).empty());
}

TEST(Crossings, SameForAnyNumberOfThreads) {
  const Surface s = shaken(lump(), 1.5, 3);
  omp_set_num_threads(1);
  const Pairs one = crossings(s);
  omp_set_num_threads(3);
  EXPECT_EQ(crossings(s), one);
  omp_set_num_threads(omp_get_num_procs());
}

TEST(TriangleTree, PairsAreThoseWhoseBoxesTouch) {
  const Surface s = shaken(torus(30, 12), 2, 4);
  Pairs wanted;
  std::vector<Eigen::AlignedBox3d> boxes(s.triangles.rows());
  for (int t = 0; t < s.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) boxes[t].extend(s.points.row(s.triangles(t, c)).transpose());
  for (int a = 0; a < s.triangles.rows(); ++a)
    for (int b = a + 1; b < s.triangles.rows(); ++b)
      if (boxes[a].intersects(boxes[b])) wanted.emplace_back(a, b);
  EXPECT_EQ(TriangleTree(s.points, s.triangles).pairs([](int, int) { return true; }), wanted);
}

TEST(TriangleTree, WhereASearchStartsChangesNothing) {
  const Surface s = lump();
  const TriangleTree tree(s.points, s.triangles);
  const Points at = shaken(lump(), 4, 5).points;
  std::vector<int> far(at.rows()), none(at.rows(), -1);
  for (std::size_t p = 0; p < far.size(); ++p) far[p] = static_cast<int>(7919 * p % s.triangles.rows());
  const auto hits = tree.closest(at), from_far = tree.closest(at, far), from_none = tree.closest(at, none);
  const Eigen::VectorXd distances = tree.distances_mm(at);
  for (Eigen::Index p = 0; p < at.rows(); ++p) {
    const TriangleTree::Hit alone = tree.closest(Eigen::Vector3d(at.row(p).transpose()));
    for (const auto* hit : {&hits[p], &from_far[p], &from_none[p]}) {
      EXPECT_EQ(hit->triangle, alone.triangle);
      EXPECT_EQ(hit->squared_mm2, alone.squared_mm2);
    }
    EXPECT_EQ(distances(p), std::sqrt(alone.squared_mm2));
  }
}

// On closed surfaces of one region a collapse is forbidden by the link condition alone, which OpenMesh tests too.
TEST(RegionMesh, CollapsesAreThoseOpenMeshAllows) {
  for (const Surface& shape : {torus(6, 2), lump(), open_sheet()}) {
    RegionMesh work(shape, std::vector<char>(shape.points.rows(), 0));
    std::mt19937 random(6);
    int allowed = 0, forbidden = 0;
    for (int i = 0; i < 40000; ++i) {
      const RegionMesh::Half half(static_cast<int>(random() % work.mesh().n_halfedges()));
      if (work.mesh().status(work.mesh().edge_handle(half)).deleted()) continue;
      const bool theirs = work.mesh().is_collapse_ok(half), ours = work.may_collapse(half);
      if (ours || !work.on_border(work.mesh().from_vertex_handle(half))) {
        EXPECT_EQ(ours, theirs);
      }
      ++(ours ? allowed : forbidden);
      if (ours) work.collapse(half);
    }
    EXPECT_GT(allowed, 80);
    EXPECT_GT(forbidden, 10);
  }
}

}  // namespace
}  // namespace supine::meshing
