// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/improve.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "meshing/mesh_check.h"
#include "meshing/quality.h"
#include "meshing/topology.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

double worst_shape(const meshing::TetMesh& mesh) {
  double worst = 180;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    Eigen::Matrix<double, 4, 3> x;
    for (int k = 0; k < 4; ++k) x.row(k) = mesh.points.row(mesh.cells(c, k));
    worst = std::min(worst, meshing::shape_angle_deg(x));
  }
  return worst;
}

TEST(MovePoints, StraightensADistortedInside) {
  meshing::TetMesh mesh = testing::box_mesh(2, 2, 2, {20, 20, 20});
  const double before = worst_shape(mesh);
  const int middle = 13;  // of 3³ points
  mesh.points.row(middle) += Eigen::RowVector3d(4, -3, 3.5);
  const double distorted = worst_shape(mesh);
  ASSERT_LT(distorted, 0.5 * before);
  ASSERT_EQ(meshing::measure_quality(mesh).inverted, 0);
  meshing::move_points(mesh, 40);
  EXPECT_GT(worst_shape(mesh), 0.9 * before);
  EXPECT_NEAR(meshing::measure_quality(mesh).volume_ml, 8, 1e-12 * 8);
}

// A flat tetrahedron under two nearly coplanar triangles of a box's roof: all its corners lie on the boundary.
meshing::TetMesh mesh_with_flat_cell() {
  meshing::TetMesh mesh = testing::box_mesh(2, 2, 2, {20, 20, 20});
  // The roof's edges run from low to high corners; a point of one diagonal is lifted, the other diagonal closes it
  // flat.
  const Eigen::Index cells = mesh.cells.rows();
  const int a = 18, b = 19, d = 21, e = 22;  // corners of a roof square (z = 20): a and e on the diagonal there is
  mesh.cells.conservativeResize(cells + 1, 4);
  mesh.points.row(b) += Eigen::RowVector3d(0, 0, 0.15);
  mesh.points.row(d) += Eigen::RowVector3d(0, 0, 0.15);
  mesh.cells.row(cells) << a, b, e, d;
  if (meshing::cell_volume_mm3(mesh.points, mesh.cells, cells) < 0) mesh.cells.row(cells) << a, e, b, d;
  mesh.tissue = Eigen::VectorXi::Constant(cells + 1, 1);
  mesh.fraction = Table::Zero(cells + 1, segmentation::tissue_count);
  mesh.fraction.col(1).setOnes();
  testing::add_boundary(mesh);
  return mesh;
}

TEST(InsertPoints, MendsAFlatTetrahedronOnTheBoundaryAndKeepsTheFaces) {
  meshing::TetMesh mesh = mesh_with_flat_cell();
  ASSERT_NO_THROW(meshing::check_mesh(mesh));
  ASSERT_LT(worst_shape(mesh), 3);
  const Indices faces = mesh.faces;
  const double volume = meshing::measure_quality(mesh).volume_ml;
  EXPECT_GT(meshing::insert_points(mesh, 16), 0);
  EXPECT_GT(worst_shape(mesh), 8);
  EXPECT_EQ(mesh.faces, faces);
  EXPECT_NEAR(meshing::measure_quality(mesh).volume_ml, volume, 1e-12 * volume);
  mesh.tissue = Eigen::VectorXi::Constant(mesh.cells.rows(), 1);
  mesh.fraction = Table::Zero(mesh.cells.rows(), segmentation::tissue_count);
  mesh.fraction.col(1).setOnes();
  EXPECT_NO_THROW(meshing::check_mesh(mesh));
}

TEST(InsertPoints, LeavesAGoodMeshAlone) {
  meshing::TetMesh mesh = testing::box_mesh(2, 2, 2, {20, 20, 20});
  const Indices cells = mesh.cells;
  EXPECT_EQ(meshing::insert_points(mesh, 16), 0);
  EXPECT_EQ(mesh.cells, cells);
}

}  // namespace
}  // namespace supine
