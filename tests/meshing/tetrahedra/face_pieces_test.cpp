// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/face_pieces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"
#include "meshing/jacobian.h"
#include "meshing/tetrahedra/curve.h"
#include "meshing/topology.h"
#include "reconstruction/surface_check.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

using meshing::TetMesh;

TetMesh curved_dome() {
  TetMesh mesh = meshing::to_quadratic(testing::dome_mesh({.rings = 6}));
  meshing::curve_boundary(mesh, testing::dome_surface({.rings = 40}), nullptr);
  return mesh;
}

double volume_mm3(const TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    sum += meshing::curved_volume_mm3(meshing::quadratic_nodes(mesh, c));
  return sum;
}

TEST(FacePieces, AreAClosedSurfaceOnTheCurvedFaces) {
  const TetMesh mesh = curved_dome();
  const reconstruction::Surface surface = meshing::face_pieces(mesh);
  const auto report = reconstruction::check_surface(surface);
  EXPECT_EQ(report.triangles, 16 * mesh.faces.rows());
  EXPECT_TRUE(report.closed() && report.manifold());
  EXPECT_EQ(report.euler, 2);
  // Flat pieces cut off a sixteenth of what flat faces do.
  const double flat = reconstruction::check_surface(testing::boundary_surface(mesh)).volume_mm3;
  const double curved = volume_mm3(mesh);
  ASSERT_GT(std::abs(curved - flat), 1e-3 * curved);
  EXPECT_NEAR((curved - report.volume_mm3) / (curved - flat), 1.0 / 16, 0.01);
}

TEST(FacePieces, KeepTheRegionsOfTheirFaces) {
  const TetMesh mesh = curved_dome();
  const reconstruction::Surface surface = meshing::face_pieces(mesh);
  const auto report = reconstruction::check_surface(surface);
  double area_mm2[report.region_area_mm2.size()] = {};
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    area_mm2[mesh.region[f]] += meshing::curved_area_mm2(mesh.points, mesh.faces, f);
  for (const int region : {1, 2, 4})
    EXPECT_NEAR(report.region_area_mm2[static_cast<std::size_t>(region)] / area_mm2[region], 1, 2e-3) << region;
}

TEST(FacePieces, RefuseLinearCells) {
  EXPECT_THROW(meshing::face_pieces(testing::dome_mesh({.rings = 4})), InputError);
}

}  // namespace
}  // namespace supine
