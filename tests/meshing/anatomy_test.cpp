// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "meshing/tetrahedra/ligament_ring.h"
#include "meshing/topology.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

const meshing::Anatomy& left_dome() {
  static const meshing::Anatomy anatomy = meshing::compute_anatomy(testing::dome_mesh(), "left");
  return anatomy;
}

TEST(Anatomy, DomeOnACylinder) {
  const testing::DomeOptions options;
  for (const int rings : {6, 12}) {
    testing::DomeOptions o = options;
    o.rings = rings;
    const auto anatomy = meshing::compute_anatomy(testing::dome_mesh(o), "left");
    EXPECT_NEAR(anatomy.foot_radius_mm, o.foot_radius_mm, 0.05 * o.foot_radius_mm) << rings;
    EXPECT_NEAR(anatomy.rim_thickness_mm, o.rim_thickness_mm, 0.3);
    EXPECT_NEAR(anatomy.mound_height_mm, o.rim_thickness_mm + o.height_mm, 1);
    EXPECT_LT(anatomy.foot_centre_mm.norm(), 1);
    EXPECT_LT((anatomy.outward - Eigen::Vector3d(0, -1, 0)).norm(), 0.01);
    EXPECT_LT((anatomy.lateral - Eigen::Vector3d(1, 0, 0)).norm(), 0.01);
    EXPECT_LT((anatomy.head - Eigen::Vector3d(0, 0, 1)).norm(), 0.01);
    EXPECT_LT(anatomy.q.row(anatomy.nipple_point).norm(), 0.05);
  }
}

TEST(Anatomy, DomeOnAPlane) {
  const auto anatomy = meshing::compute_anatomy(testing::dome_mesh({.muscle_radius_mm = 0}), "left");
  EXPECT_NEAR(anatomy.foot_radius_mm, 64, 0.05 * 64);
  EXPECT_NEAR(anatomy.rim_thickness_mm, 12, 0.3);
}

TEST(Anatomy, WithoutARimTheFootIsTheEdge) {
  const auto anatomy = meshing::compute_anatomy(testing::dome_mesh({.rim_factor = 0.8, .muscle_radius_mm = 0}), "left");
  EXPECT_NEAR(anatomy.foot_radius_mm, 0.8 * 64, 0.05 * 64);
}

TEST(Anatomy, LateralOfARightBreastIsMirrored) {
  const auto& left = left_dome();
  const auto right = meshing::compute_anatomy(testing::dome_mesh(), "right");
  EXPECT_LT((left.lateral + right.lateral).norm(), 1e-12);
  EXPECT_EQ(left.head, right.head);
}

TEST(Anatomy, TurnsWithTheBody) {
  const auto mesh = testing::dome_mesh();
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d shift(60, -20, 900);
  const auto& straight = left_dome();
  const auto turned = meshing::compute_anatomy(testing::moved(mesh, rotation, shift), "left");
  EXPECT_NEAR(turned.foot_radius_mm, straight.foot_radius_mm, 0.3);
  EXPECT_LT((turned.foot_centre_mm - rotation * straight.foot_centre_mm - shift).norm(), 0.3);
  EXPECT_LT((turned.outward - rotation * straight.outward).norm(), 0.005);
  EXPECT_LT((turned.q - straight.q).cwiseAbs().maxCoeff(), 0.01);
}

TEST(Anatomy, LinearAndQuadraticMeshHaveTheSame) {
  const auto mesh = testing::dome_mesh({.rings = 6});
  const auto linear = meshing::compute_anatomy(mesh, "left"),
             quadratic = meshing::compute_anatomy(meshing::to_quadratic(mesh), "left");
  EXPECT_DOUBLE_EQ(linear.foot_radius_mm, quadratic.foot_radius_mm);
  EXPECT_EQ(quadratic.q.rows(), quadratic.thickness_mm.size());
}

TEST(Anatomy, ThicknessAndNormalsAreThoseOfTheMuscle) {
  const auto mesh = testing::dome_mesh();
  const auto& anatomy = left_dome();
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (mesh.region[f] != 1) continue;
    EXPECT_NEAR(anatomy.thickness_mm[mesh.faces(f, 0)], 0, 0.1);
  }
  EXPECT_NEAR(anatomy.thickness_mm.maxCoeff(), 56, 1);
  EXPECT_LT((anatomy.muscle_normal.rowwise().norm().array() - 1).abs().maxCoeff(), 1e-12);
}

TEST(Anatomy, NippleTissueDecidesWhereTheNippleIs) {
  auto mesh = testing::dome_mesh();
  const Eigen::RowVector3d wanted(25, -45, 10);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
    for (int k = 0; k < 4; ++k) centre += mesh.points.row(mesh.cells(c, k)) / 4;
    if ((centre - wanted).norm() > 10) continue;
    mesh.fraction.row(c).setZero();
    mesh.fraction(c, static_cast<int>(segmentation::Tissue::nipple)) = 1;
  }
  const auto anatomy = meshing::compute_anatomy(mesh, "left");
  EXPECT_LT((mesh.points.row(anatomy.nipple_point) - wanted).norm(), 12);
}

TEST(Anatomy, DistanceFromTheFootIsThatOfACircle) {
  meshing::Anatomy anatomy;
  anatomy.foot_radius_mm = 60;
  anatomy.foot_fourier = Eigen::VectorXd::Zero(7);
  anatomy.foot_fourier[0] = 60;
  EXPECT_NEAR(anatomy.from_foot_mm({1.25, 0}), 15, 1e-12);
  EXPECT_NEAR(anatomy.from_foot_mm({0, -0.5}), -30, 1e-12);
}

TEST(Anatomy, DistanceFromTheFootIsThatOfAnEllipse) {
  meshing::Anatomy anatomy;  // r = 60 + 3 cos 2θ
  anatomy.foot_radius_mm = 60;
  anatomy.foot_fourier = Eigen::VectorXd::Zero(7);
  anatomy.foot_fourier[0] = 60;
  anatomy.foot_fourier[3] = 3;
  for (double theta = 0; theta < 6.28; theta += 0.3) {
    double nearest = 1e300;
    const Eigen::Vector2d p = 66 * Eigen::Vector2d(std::cos(theta), std::sin(theta));
    for (double t = 0; t < 6.2832; t += 0.0005) {
      nearest = std::min(nearest, (p - anatomy.foot_radius_at(t) * Eigen::Vector2d(std::cos(t), std::sin(t))).norm());
    }
    EXPECT_NEAR(anatomy.from_foot_mm(p / 60), nearest, 0.05);
  }
}

TEST(Anatomy, AreasAreNamedAboutTheNipple) {
  const auto& anatomy = left_dome();
  EXPECT_EQ(anatomy.area_name({0, 0}), "nipple area");
  EXPECT_EQ(anatomy.area_name({0.5, 0.5}), "upper outer");
  EXPECT_EQ(anatomy.area_name({0.5, -0.5}), "lower outer");
  EXPECT_EQ(anatomy.area_name({-0.5, 0.5}), "upper inner");
  EXPECT_EQ(anatomy.area_name({-0.5, -0.5}), "lower inner");
  EXPECT_EQ(anatomy.area_name({0, -1.2}), "fold");
  EXPECT_EQ(anatomy.area_name({0, 1.2}), "upper edge");
  EXPECT_EQ(anatomy.area_name({1.2, 0}), "lateral edge");
  EXPECT_EQ(anatomy.area_name({-1.2, 0}), "sternal edge");
  EXPECT_EQ(meshing::area_names().size(), 9u);
}

TEST(Anatomy, LigamentRingLiesAtTheFoot) {
  auto mesh = testing::dome_mesh({.rings = 16});
  const auto anatomy = meshing::compute_anatomy(mesh, "left");
  EXPECT_GT(meshing::mark_ligament_ring(mesh, anatomy), 20);
  double area = 0;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (mesh.region[f] == 3) area += meshing::face_area_mm2(mesh.points, mesh.faces, f);
  }
  EXPECT_NEAR(area, 2 * 3.14159 * 64 * 12, 0.25 * 2 * 3.14159 * 64 * 12);
}

TEST(Anatomy, RefusesAnotherSide) {
  EXPECT_THROW(meshing::compute_anatomy(testing::dome_mesh({.rings = 4}), "both"), InputError);
}

TEST(Anatomy, RefusesAMeshWithoutInnerFaces) {
  auto mesh = testing::dome_mesh({.rings = 4});
  mesh.region.setConstant(2);
  EXPECT_THROW(meshing::compute_anatomy(mesh, "left"), InputError);
}

TEST(Anatomy, RefusesASlabWithoutAMound) {
  EXPECT_THROW(meshing::compute_anatomy(testing::dome_mesh({.height_mm = 0.5}), "left"), InputError);
}

}  // namespace
}  // namespace supine
