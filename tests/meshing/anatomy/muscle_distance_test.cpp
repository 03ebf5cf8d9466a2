// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/muscle_distance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "common/error.h"
#include "tests/support/shapes.h"

namespace supine {
namespace {

constexpr double muscle_radius_mm = 145;
constexpr double rim_mm = 80;  // of the sheet, along the arc

testing::DomeOptions dome(double radius_mm) {
  return {.foot_radius_mm = 64,
          .rim_factor = rim_mm / 64,
          .muscle_radius_mm = radius_mm,
          .rings = 4,
          .layers = 1,
          .muscle_rings = 60};
}

Eigen::Matrix<double, 2, 3> box_of(const Points& points) {
  Eigen::Matrix<double, 2, 3> box;
  box.row(0) = points.colwise().minCoeff();
  box.row(1) = points.colwise().maxCoeff();
  return box;
}

meshing::MuscleDistance fit(const meshing::TetMesh& mesh) { return {mesh.muscle, box_of(mesh.points)}; }

const meshing::MuscleDistance& cylinder() {
  static const meshing::MuscleDistance distance = fit(testing::dome_mesh(dome(muscle_radius_mm)));
  return distance;
}

// The point at arc length s and height h over the cylinder (dome_mesh's frame).
Eigen::Vector3d over_cylinder(double s, double z, double h) {
  const double angle = s / muscle_radius_mm, r = muscle_radius_mm + h;
  return {r * std::sin(angle), muscle_radius_mm - r * std::cos(angle), z};
}

// Largest error of φ and of |∇φ| on a ring of arc radius `ring_mm` at height h.
struct Errors {
  double value_mm = 0, slope = 0, mean_square = 0;
};

Errors ring_errors(const meshing::MuscleDistance& distance, double ring_mm, double height_mm) {
  Errors errors;
  constexpr int count = 36;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    const auto sample = distance.at(over_cylinder(ring_mm * std::cos(angle), ring_mm * std::sin(angle), height_mm));
    errors.value_mm = std::max(errors.value_mm, std::abs(sample.value_mm - height_mm));
    errors.slope = std::max(errors.slope, std::abs(sample.gradient.norm() - 1));
    errors.mean_square += std::pow(sample.value_mm - height_mm, 2) / count;
  }
  return errors;
}

TEST(MuscleDistance, PlaneIsExactEverywhere) {
  const auto distance = fit(testing::dome_mesh(dome(0)));
  for (const double h : {-30.0, -5.0, 0.0, 10.0, 70.0}) {
    for (const double s : {0.0, 60.0, 119.0, 300.0}) {
      const auto sample = distance.at({s, -h, s / 3});
      EXPECT_NEAR(sample.value_mm, h, 1e-6);  // energies vanish on planes
      EXPECT_LT((sample.gradient - Eigen::Vector3d(0, -1, 0)).norm(), 1e-7);
      EXPECT_LT(sample.hessian.norm(), 1e-7);
    }
  }
  EXPECT_LT(distance.fit_rms_mm(), 1e-6);
}

TEST(MuscleDistance, CylinderIsReproducedOnAndNearTheSheet) {
  const auto& distance = cylinder();
  for (const double ring : {0.0, 20.0, 40.0, 60.0, 75.0, rim_mm}) {
    for (const double h : {0.0, 5.0, 10.0}) {
      const Errors errors = ring_errors(distance, ring, h);
      EXPECT_LT(errors.value_mm, 0.1) << ring << " " << h;
      EXPECT_LT(errors.slope, 0.02) << ring << " " << h;
    }
    EXPECT_LT(ring_errors(distance, ring, -10).slope, 0.02);
  }
  EXPECT_LT(distance.fit_rms_mm(), 0.03);
}

TEST(MuscleDistance, CylinderGoesOnPastTheRim) {
  const auto& distance = cylinder();
  EXPECT_LT(ring_errors(distance, rim_mm + 20, 0).value_mm, 1.0);
  EXPECT_LT(ring_errors(distance, rim_mm + 20, 10).value_mm, 1.0);
  const Errors far = ring_errors(distance, rim_mm + 40, 0);  // a plane would miss by 5.3 mm
  EXPECT_LT(far.value_mm, 2.5);
  EXPECT_LT(far.slope, 0.1);
}

TEST(MuscleDistance, VoxelStaircaseIsSmoothed) {
  meshing::TetMesh mesh = testing::dome_mesh(dome(muscle_radius_mm));
  const Eigen::RowVector3d axis = Eigen::RowVector3d(0.2, -0.95, 0.1).normalized();
  for (Eigen::Index i = 0; i < mesh.muscle.points.rows(); ++i) {  // terraces of 1.5 mm voxels, smoothed a little
    const double height = mesh.muscle.points.row(i).dot(axis);
    mesh.muscle.points.row(i) += 0.6 * (1.5 * std::round(height / 1.5) - height) * axis;
  }
  const auto distance = fit(mesh);
  for (const double ring : {0.0, 20.0, 40.0, 60.0, 75.0}) {
    const Errors errors = ring_errors(distance, ring, 0);
    EXPECT_LT(errors.value_mm, 0.3) << ring;
    EXPECT_LT(std::sqrt(errors.mean_square), 0.15) << ring;
    EXPECT_LT(errors.slope, 0.02) << ring;
  }
  EXPECT_LT(ring_errors(distance, rim_mm + 20, 0).value_mm, 1.2);
}

TEST(MuscleDistance, UncorrelatedRoughnessIsSmoothed) {
  meshing::TetMesh mesh = testing::dome_mesh(dome(muscle_radius_mm));
  std::mt19937 generator(7);
  std::normal_distribution<double> noise(0, 0.4);
  for (Eigen::Index i = 0; i < mesh.muscle.points.rows(); ++i) mesh.muscle.points(i, 1) += noise(generator);
  const auto distance = fit(mesh);
  for (const double ring : {0.0, 40.0, 75.0}) EXPECT_LT(ring_errors(distance, ring, 0).value_mm, 0.2);
}

TEST(MuscleDistance, SlopeAndCurvatureAreThoseOfTheValue) {
  const auto& distance = cylinder();
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(10, -5, 20), Eigen::Vector3d(-95, 30, 10), Eigen::Vector3d(200, -90, 10),
        Eigen::Vector3d(-150, 100, 200)}) {  // the last two lie outside the box
    const Eigen::Vector3d direction = Eigen::Vector3d(any(generator), any(generator), any(generator)).normalized();
    const auto here = distance.at(at);
    EXPECT_NEAR(distance.value(at), here.value_mm, 1e-12 * 100);
    EXPECT_LT((here.hessian - here.hessian.transpose()).norm(), 1e-15);
    double previous_value = 0, previous_slope = 0;
    for (int halving = 0; halving < 4; ++halving) {
      const double h = 0.8 / (1 << halving);
      const auto there = distance.at(at + h * direction);
      const double value = std::abs(there.value_mm - here.value_mm - h * here.gradient.dot(direction));
      const double slope = (there.gradient - here.gradient - h * here.hessian * direction).norm();
      if (halving > 0 && previous_value > 1e-9) {
        EXPECT_GT(std::log2(previous_value / value), 1.9) << at.transpose();
      }
      if (halving > 0 && previous_slope > 1e-9) {
        EXPECT_GT(std::log2(previous_slope / slope), 1.9) << at.transpose();
      }
      previous_value = value;
      previous_slope = slope;
    }
  }
}

TEST(MuscleDistance, TurnsAndMovesWithTheSheet) {
  const meshing::TetMesh mesh = testing::dome_mesh(dome(muscle_radius_mm));
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const Eigen::Vector3d shift(120, -40, 300);
  const auto& straight = cylinder();
  const auto turned = fit(testing::moved(mesh, rotation, shift));
  for (const double ring : {0.0, 40.0, 75.0}) {
    for (const double h : {-5.0, 0.0, 10.0, 40.0}) {
      const Eigen::Vector3d p = over_cylinder(ring, ring / 4, h);
      const auto a = straight.at(p), b = turned.at(rotation * p + shift);
      EXPECT_NEAR(a.value_mm, b.value_mm, 0.1);
      EXPECT_LT((rotation * a.gradient - b.gradient).norm(), 0.01);
    }
  }
}

TEST(MuscleDistance, SheetMayBeCoarse) {
  meshing::TetMesh mesh = testing::dome_mesh({.muscle_radius_mm = 0, .rings = 4, .layers = 1, .muscle_rings = 2});
  ASSERT_LT(mesh.muscle.triangles.rows(), 30);
  EXPECT_NEAR(fit(mesh).value({5, -12, 7}), 12, 1e-6);
}

TEST(MuscleDistance, OfAFlatFaceOfTwoTrianglesAsCadHasItIsThatToItsPlane) {
  reconstruction::Surface face;
  face.points.resize(4, 3);
  face.points << -30, 0, -20, 30, 0, -20, -30, 0, 20, 30, 0, 20;
  face.triangles.resize(2, 3);
  face.triangles << 0, 2, 1, 1, 2, 3;  // outward +y
  Eigen::Matrix<double, 2, 3> reach;
  reach << -30, 0, -20, 30, 25, 20;
  const meshing::MuscleDistance distance(face, reach);
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 12, 0), {28, 5, -18}, {-29, 20, 19}}) {
    const auto sample = distance.at(at);
    EXPECT_NEAR(sample.value_mm, at.y(), 1e-6);
    EXPECT_LT((sample.gradient - Eigen::Vector3d::UnitY()).norm(), 1e-6);
  }
}

TEST(MuscleDistance, RefusesASheetOfNoArea) {
  meshing::TetMesh mesh = testing::dome_mesh({.rings = 2, .layers = 1, .muscle_rings = 4});
  mesh.muscle.points *= 0.001;  // metres
  EXPECT_THROW(fit(mesh), InputError);
}

}  // namespace
}  // namespace supine
