// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/surface/crossings.h"

#include <gtest/gtest.h>
#include <omp.h>

#include "meshing/surface/sound_surface.h"
#include "tests/meshing/surface_shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::self_intersections;
using reconstruction::Surface;
using testing::lump;
using testing::moved_by;
using testing::open_sheet;
using testing::shaken;
using testing::together;
using testing::torus;
using testing::voxels;

using Pairs = std::vector<std::pair<int, int>>;

Pairs crossings(const Surface& s) { return meshing::crossings(s, TriangleTree(s.points, s.triangles)); }

Surface box() {
  return voxels(4, 4, 4, 1, [](int, int, int) { return true; });
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

}  // namespace
}  // namespace supine::meshing
