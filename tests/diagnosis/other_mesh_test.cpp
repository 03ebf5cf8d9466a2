// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/other_mesh.h"

#include <gtest/gtest.h>

#include <cmath>

#include "meshing/jacobian.h"
#include "meshing/tetrahedra/curve.h"
#include "meshing/tetrahedra/grade.h"
#include "meshing/topology.h"
#include "tests/support/shapes.h"

namespace supine::diagnosis {
namespace {

using meshing::TetMesh;

TetMesh curved_dome() {
  TetMesh mesh = meshing::to_quadratic(testing::dome_mesh({.rings = 8}));
  meshing::curve_boundary(mesh, testing::dome_surface({.rings = 40}), nullptr);
  return mesh;
}

double volume_mm3(const TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    sum += mesh.order() == 2 ? meshing::curved_volume_mm3(meshing::quadratic_nodes(mesh, c))
                             : meshing::cell_volume_mm3(mesh.points, mesh.cells, c);
  return sum;
}

double skin_edge_of(const TetMesh& mesh) { return meshing::skin_edge_mm(testing::boundary_surface(mesh)); }

TEST(OtherMesh, OfCurvedCellsIsCurvedOntoTheirFaces) {
  const TetMesh mesh = curved_dome();
  const meshing::Anatomy anatomy = meshing::compute_anatomy(mesh, "left");
  const double curved = volume_mm3(mesh);
  TetMesh flat = mesh;  // what straight edges between the same corners would leave out
  for (Eigen::Index c = 0; c < flat.cells.rows(); ++c)
    for (int e = 0; e < 6; ++e)
      flat.points.row(flat.cells(c, 4 + e)) = (flat.points.row(flat.cells(c, meshing::tet_edges[e][0])) +
                                               flat.points.row(flat.cells(c, meshing::tet_edges[e][1]))) /
                                              2;
  const double missed = curved - volume_mm3(flat);
  ASSERT_GT(missed, 1e-3 * curved);
  for (const TetMesh& other : {other_mesh(mesh, 0.5), coarser_mesh(mesh, anatomy, 0.8)}) {
    EXPECT_EQ(other.order(), 2);
    EXPECT_LT(std::abs(volume_mm3(other) - curved), missed / 4);
  }
}

TEST(OtherMesh, IsFinerAtTheSkinsEndThanTheMeshIsThere) {
  TetMesh mesh = testing::dome_mesh({.rings = 6, .layers = 2});
  for (int twice = 0; twice < 2; ++twice) {
    const TetMesh finer = other_mesh(mesh, 0.5);
    EXPECT_LT(skin_edge_of(finer), 0.7 * skin_edge_of(mesh)) << twice;
    EXPECT_NEAR(volume_mm3(finer) / volume_mm3(mesh), 1, 1e-3);
    mesh = finer;
  }
}

/// A ball of gland: one in cells whose centre lies inside, by half in those at its border.
void put_gland(TetMesh& mesh, const Eigen::RowVector3d& middle, double radius_mm) {
  constexpr auto fat = static_cast<int>(segmentation::Tissue::adipose),
                 gland = static_cast<int>(segmentation::Tissue::gland);
  mesh.fraction.setZero();
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    int inside = 0;
    for (int a = 0; a < 4; ++a) inside += (mesh.points.row(mesh.cells(c, a)) - middle).norm() < radius_mm;
    mesh.fraction(c, gland) = 0.25 * inside;
    mesh.fraction(c, fat) = 1 - 0.25 * inside;
    mesh.tissue[c] = inside > 2 ? gland : fat;
  }
}

double gland_mm3(const TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    sum += mesh.fraction(c, static_cast<int>(segmentation::Tissue::gland)) *
           meshing::cell_volume_mm3(mesh.points, mesh.cells, c);
  return sum;
}

TEST(OtherMesh, HoldsAsMuchOfATissueWhereItIs) {
  TetMesh mesh = testing::dome_mesh({.rings = 8, .layers = 4});
  const Eigen::RowVector3d middle = 0.5 * (mesh.points.colwise().minCoeff() + mesh.points.colwise().maxCoeff());
  const double size_mm = (mesh.points.colwise().maxCoeff() - mesh.points.colwise().minCoeff()).minCoeff();
  put_gland(mesh, middle, 0.3 * size_mm);
  const double gland = gland_mm3(mesh);
  const meshing::Anatomy anatomy = meshing::compute_anatomy(mesh, "left");
  for (const TetMesh& other : {other_mesh(mesh, 0.5), coarser_mesh(mesh, anatomy, 0.5)}) {
    EXPECT_NEAR(gland_mm3(other) / gland, 1, 0.03);
    for (Eigen::Index c = 0; c < other.cells.rows(); ++c) {
      EXPECT_NEAR(other.fraction.row(c).sum(), 1, 1e-12);
      const Eigen::RowVector3d centre = other.points(other.cells.row(c).head<4>(), Eigen::all).colwise().mean();
      const bool far = (centre - middle).norm() > 0.8 * size_mm;
      EXPECT_TRUE(!far || other.tissue[c] == static_cast<int>(segmentation::Tissue::adipose)) << centre;
    }
  }
}

}  // namespace
}  // namespace supine::diagnosis
