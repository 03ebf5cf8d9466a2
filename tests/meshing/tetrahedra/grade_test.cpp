// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/grade.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "common/error.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

using reconstruction::Surface;

constexpr int skin = 2, cut = 4;

Surface dome() { return testing::dome_surface({.rings = 10, .layers = 2}); }

std::vector<double> skin_edges_mm(const Surface& surface) {
  std::vector<double> lengths;
  for (const auto& edge : reconstruction::mesh_edges(surface.triangles)) {
    const std::set<int> regions = {surface.region[edge.triangles[0]], surface.region[edge.triangles[1]]};
    if (regions == std::set<int>{skin, cut})
      lengths.push_back((surface.points.row(edge.points[0]) - surface.points.row(edge.points[1])).norm());
  }
  return lengths;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v / static_cast<double>(values.size());
  return sum;
}

TEST(Grade, EdgesAreShortOnTheSkinsBorder) {
  const Surface coarse = dome();
  for (const double share : {0.5, 0.25}) {
    const double wanted = share * meshing::mean_edge_mm(coarse);
    const Surface graded = meshing::refine_skin_edge(coarse, wanted);
    EXPECT_NEAR(mean(skin_edges_mm(graded)), wanted, 0.35 * wanted);
    EXPECT_DOUBLE_EQ(meshing::skin_edge_mm(graded), mean(skin_edges_mm(graded)));
    EXPECT_LT(graded.triangles.rows(), 6 * coarse.triangles.rows());
    EXPECT_NO_THROW(meshing::tetrahedralise(graded, {.edge_mm = meshing::mean_edge_mm(coarse)}));
  }
}

TEST(Grade, ShapeTopologyAndWhatIsFarStay) {
  const Surface coarse = dome();
  const double edge = meshing::mean_edge_mm(coarse);
  const Surface graded = meshing::refine_skin_edge(coarse, edge / 4);
  const auto before = reconstruction::check_surface(coarse), after = reconstruction::check_surface(graded);
  EXPECT_TRUE(after.closed());
  EXPECT_TRUE(after.manifold());
  EXPECT_EQ(before.euler, after.euler);
  EXPECT_NEAR(after.volume_mm3, before.volume_mm3, 2e-4 * before.volume_mm3);
  for (const int region : {1, 2, 4})
    EXPECT_NEAR(after.region_area_mm2[region], before.region_area_mm2[region], 0.01 * before.region_area_mm2[region]);
  // The top of the mound is more than two edges from the rim: the same triangles, moved by the volume's offset alone.
  const auto near_top = [](const Surface& s) {
    Eigen::Index count = 0;
    for (Eigen::Index t = 0; t < s.triangles.rows(); ++t)
      for (int k = 0; k < 3; ++k) count += s.points(s.triangles(t, k), 1) < -35;
    return count;
  };
  EXPECT_GT(near_top(coarse), 30);
  EXPECT_EQ(near_top(graded), near_top(coarse));
}

TEST(Grade, NothingToDoLeavesTheSurface) {
  const Surface coarse = dome();
  EXPECT_EQ(meshing::refine_skin_edge(coarse, meshing::mean_edge_mm(coarse)).points, coarse.points);
  Surface no_cut = coarse;
  no_cut.region.setConstant(skin);
  EXPECT_EQ(meshing::refine_skin_edge(no_cut, 1).points, no_cut.points);
  EXPECT_THROW(meshing::refine_skin_edge(coarse, 0), InputError);
  EXPECT_THROW(meshing::refine_skin_edge(coarse, -2), InputError);
}

}  // namespace
}  // namespace supine
