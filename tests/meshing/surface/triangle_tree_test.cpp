// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/surface/triangle_tree.h"

#include <gtest/gtest.h>

#include "tests/meshing/surface_shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;
using testing::lump;
using testing::shaken;
using testing::torus;

TEST(TriangleTree, PairsAreThoseWhoseBoxesTouch) {
  const Surface s = shaken(torus(30, 12), 2, 4);
  std::vector<std::pair<int, int>> wanted;
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

}  // namespace
}  // namespace supine::meshing
