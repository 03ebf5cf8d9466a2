// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/topology.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "common/error.h"
#include "meshing/mesh_check.h"
#include "meshing/quality.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

TEST(Boundary, TwoTetrahedraHaveSixFaces) {
  Indices cells(2, 4);
  cells << 0, 1, 2, 3, 1, 2, 3, 4;
  const meshing::Boundary boundary = meshing::boundary_of(cells);
  EXPECT_EQ(boundary.faces.rows(), 6);
  for (int f = 0; f < 6; ++f) EXPECT_EQ(boundary.face_cell[f], f < 3 ? 0 : 1);
}

TEST(Boundary, FacesLookOutward) {
  const meshing::TetMesh box = testing::box_mesh(2, 3, 4, {20, 30, 40});
  double volume = 0;  // divergence theorem
  for (Eigen::Index f = 0; f < box.faces.rows(); ++f) {
    Eigen::Matrix3d x;
    for (int k = 0; k < 3; ++k) x.row(k) = box.points.row(box.faces(f, k));
    volume += x.determinant() / 6;
  }
  EXPECT_NEAR(volume, 24000, 1e-9 * 24000);
}

TEST(Boundary, RefusesThreeTetrahedraOnOneFace) {
  Indices cells(3, 4);
  cells << 0, 1, 2, 3, 0, 1, 2, 4, 0, 1, 2, 5;
  EXPECT_THROW(meshing::boundary_of(cells), InputError);
}

TEST(Box, VolumeAndAreasAreExact) {
  const meshing::QualityReport q = meshing::measure_quality(testing::box_mesh(4, 3, 2, {40, 30, 20}));
  EXPECT_EQ(q.cells, 6 * 24);
  EXPECT_NEAR(q.volume_ml, 24, 1e-12 * 24);
  EXPECT_NEAR(q.area_cm2[1], 12, 1e-12 * 12);
  EXPECT_NEAR(q.area_cm2[2], 52 - 12, 1e-12 * 52);
}

TEST(Quadratic, KeepsVolumeSharesMiddlesAndPassesTheCheck) {
  const meshing::TetMesh linear = testing::box_mesh(2, 2, 2, {10, 10, 10});
  const meshing::TetMesh quadratic = meshing::to_quadratic(linear);
  EXPECT_EQ(quadratic.order(), 2);
  EXPECT_EQ(quadratic.points.rows(), 125);  // Kuhn cubes: middles of edges, face and cube diagonals fill the 5³ lattice
  EXPECT_NO_THROW(meshing::check_mesh(quadratic));
  for (int e = 0; e < 6; ++e) {
    const auto [a, b] = meshing::tet_edges[e];
    const Eigen::RowVector3d middle =
        (quadratic.points.row(quadratic.cells(0, a)) + quadratic.points.row(quadratic.cells(0, b))) / 2;
    EXPECT_EQ((quadratic.points.row(quadratic.cells(0, 4 + e)) - middle).norm(), 0);
  }
}

class Damaged : public ::testing::Test {
 protected:
  meshing::TetMesh mesh_ = testing::box_mesh(1, 1, 1, {10, 10, 10});
  void expect_refused(const std::string& part) const {
    try {
      meshing::check_mesh(mesh_);
      FAIL() << "not refused";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
};

TEST_F(Damaged, SoundMeshPasses) { EXPECT_NO_THROW(meshing::check_mesh(mesh_)); }

TEST_F(Damaged, InvertedTetrahedronIsNamedWithItsPlace) {
  std::swap(mesh_.cells(2, 0), mesh_.cells(2, 1));
  expect_refused("tetrahedron 2 at (");
}

TEST_F(Damaged, MissingFace) {
  mesh_.faces.conservativeResize(mesh_.faces.rows() - 1, 3);
  mesh_.region.conservativeResize(mesh_.faces.rows());
  mesh_.face_cell.conservativeResize(mesh_.faces.rows());
  expect_refused("boundary triangles");
}

TEST_F(Damaged, FaceThatLooksInward) {
  std::swap(mesh_.faces(3, 0), mesh_.faces(3, 1));
  expect_refused("triangle 3 at (");
}

TEST_F(Damaged, RegionOutOfRange) {
  mesh_.region[0] = 0;
  expect_refused("region 0");
}

TEST_F(Damaged, TissueThatIsNotMeshed) {
  mesh_.tissue[1] = static_cast<int>(segmentation::Tissue::muscle);
  expect_refused("tissue 4");
}

TEST_F(Damaged, FractionsThatDoNotSumToOne) {
  mesh_.fraction(0, 1) = 0.9;
  expect_refused("0.9");
}

TEST_F(Damaged, PointThatIsNotFinite) {
  mesh_.points(0, 0) = std::nan("");
  expect_refused("finite");
}

TEST_F(Damaged, IndexOutOfRange) {
  mesh_.cells(0, 0) = 99;
  expect_refused("99");
}

}  // namespace
}  // namespace supine
