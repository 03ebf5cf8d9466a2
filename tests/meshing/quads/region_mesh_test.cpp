// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/region_mesh.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/meshing/surface_shapes.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;
using testing::lump;
using testing::open_sheet;
using testing::torus;

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
