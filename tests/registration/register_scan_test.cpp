// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/register_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/error.h"
#include "common/statistics.h"
#include "tests/calibration/shapes.h"

namespace supine::registration {
namespace {

/// A skin without symmetry, 140 mm wide.
double height(double x, double y) {
  const double dome = 45 * std::exp(-((x - 8) * (x - 8) / 2200 + (y + 5) * (y + 5) / 1400));
  return dome + 24 * std::exp(-((x + 35) * (x + 35) + (y - 30) * (y - 30)) / 300) + 0.002 * x * x;
}

double round_dome(double x, double y) { return std::sqrt(std::max(0.0, 90.0 * 90.0 - x * x - y * y)); }

/// A body, and a scan of a part of it with noise of 0.5 mm.
struct Scene {
  reconstruction::Surface body;
  calibration::SurfaceDistance skin;
  Problem problem;

  explicit Scene(double (*shape)(double, double) = height, double scan_half_width = 50, unsigned seed = 1)
      : body(testing::sheet(-70, 70, 56, shape)), skin(body.points, body.triangles) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 0.5);
    const reconstruction::Surface scan = testing::sheet(-scan_half_width, scan_half_width, 40, shape);
    const calibration::SurfaceDistance seen(scan.points, scan.triangles);
    problem.points = scan.points;
    problem.normals = seen.normals();
    for (Eigen::Index p = 0; p < scan.points.rows(); ++p)
      problem.points.row(p) += noise(random) * problem.normals.row(p);
    problem.noise_mm = 0.5;
    problem.target.skin = &skin;
  }

  void add_landmarks() {
    const std::pair<const char*, Eigen::Vector2d> at[] = {
        {"nipple", {8, -5}}, {"knob", {-35, 30}}, {"left", {40, 20}}, {"lower", {10, -45}}, {"right", {-40, -30}}};
    for (const auto& [name, xy] : at) {
      const Eigen::Vector3d place(xy.x(), xy.y(), height(xy.x(), xy.y()));
      problem.landmarks.push_back({name, place, place, Eigen::Vector3d::Zero(), 1.0, false});
    }
  }

  void move(const Eigen::Matrix3d& by, const Eigen::Vector3d& shift = Eigen::Vector3d::Zero()) {
    problem.points = (problem.points * by.transpose()).rowwise() + shift.transpose();
    problem.normals = problem.normals * by.transpose();
    for (Eigen::Index p = 0; p < problem.normals.rows(); ++p)
      problem.normals.row(p) = problem.normals.row(p).normalized().eval();  // zero stays zero
    for (Landmark& l : problem.landmarks) l.scan = by * l.scan + shift;
  }

  Registration registered() const { return register_scan(problem, {}, true, "scan.ply"); }

  std::string complaint() const {
    try {
      registered();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

double rms_off_mm(const Problem& problem, const RigidTransform& found, const RigidTransform& truth) {
  return (found.apply(problem.points) - truth.apply(problem.points)).norm() /
         std::sqrt(static_cast<double>(problem.points.rows()));
}

TEST(RigidTransforms, MotionAboutAPivotGoesThereAndBack) {
  Motion motion;
  motion << 3, -4, 5, 0.3, -1.2, 0.7;
  const Eigen::Vector3d pivot(10, 20, -30);
  EXPECT_LT((motion_about(pivot, turned_about(pivot, motion)) - motion).norm(), 1e-12);
  const RigidTransform transform = turned_about(pivot, motion);
  const RigidTransform none = transform.then(transform.inverse());
  EXPECT_LT((none.rotation - Eigen::Matrix3d::Identity()).norm() + none.shift.norm(), 1e-12);
}

TEST(RegisterScan, FindsAnyPlaceByLandmarks) {
  Scene scene;
  scene.add_landmarks();
  const RigidTransform by{testing::some_rotation(), {210, -150, 120}};
  scene.move(by.rotation, by.shift);
  const Registration found = scene.registered();
  EXPECT_LT(rms_off_mm(scene.problem, found.fit.transform, by.inverse()), 1);
  EXPECT_LT(found.after_mm, found.before_mm);
  EXPECT_FALSE(found.worse_than_given());
  EXPECT_GT(found.overlap, 0.95);
}

TEST(RegisterScan, ItsRegionHoldsTheTruthWithoutLandmarks) {
  int held = 0;
  constexpr int draws = 3;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int draw = 0; draw < draws; ++draw) {
    Scene scene(height, 45, 100 + draw);
    Motion motion;
    for (int k = 0; k < 6; ++k) motion[k] = (k < 3 ? 15 : 0.2) * uniform(random);
    const RigidTransform by = turned_about({0, 0, 20}, motion);
    scene.move(by.rotation, by.shift);
    const Registration found = scene.registered();
    held += mahalanobis_squared(found.fit, by.inverse()) <= chi_squared_quantile(6, 0.95);
    EXPECT_LT(rms_off_mm(scene.problem, found.fit.transform, by.inverse()), 2) << draw;
  }
  EXPECT_EQ(held, draws);
}

/// Rows of points in place of the surface, as given without normals.
void make_contour(Scene& scene, double half_width, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.5);
  scene.problem.points = testing::contour(-half_width, half_width, height);
  for (Eigen::Index p = 0; p < scene.problem.points.rows(); ++p) scene.problem.points(p, 2) += noise(random);
  scene.problem.normals = calibration::SurfaceDistance(scene.problem.points, Triangles(0, 3)).normals();
}

TEST(RegisterScan, LaysAContourOnTheBody) {
  int held = 0;
  constexpr int draws = 4;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int draw = 0; draw < draws; ++draw) {
    Scene scene;
    make_contour(scene, 45, 200 + draw);
    Motion motion;
    for (int k = 0; k < 6; ++k) motion[k] = (k < 3 ? 12 : 0.15) * uniform(random);
    const RigidTransform by = turned_about({0, 0, 20}, motion);
    scene.move(by.rotation, by.shift);
    const Registration found = scene.registered();
    held += mahalanobis_squared(found.fit, by.inverse()) <= chi_squared_quantile(6, 0.95);
    EXPECT_LT(rms_off_mm(scene.problem, found.fit.transform, by.inverse()), 2) << draw;
    EXPECT_GT(found.overlap, 0.95);
    EXPECT_FALSE(found.worse_than_given());
  }
  EXPECT_GE(held, draws - 1);
}

TEST(RegisterScan, RowsAlongAPrismDoNotSayHowFarAlongItTheyLie) {
  Scene scene([](double x, double) { return 0.01 * x * x; });
  make_contour(scene, 30, 5);
  for (Eigen::Index p = 0; p < scene.problem.points.rows(); ++p)
    scene.problem.points(p, 2) +=
        0.01 * std::pow(scene.problem.points(p, 0), 2) - height(scene.problem.points(p, 0), scene.problem.points(p, 1));
  const auto weak = weak_directions(scene.registered().fit);
  ASSERT_EQ(weak.size(), 1u);
  EXPECT_FALSE(weak.front().turn);
  EXPECT_GT(std::abs(weak.front().axis.y()), 0.95);
}

TEST(RegisterScan, PointsThatSayTheSameCountForLess) {
  Scene scene;
  make_contour(scene, 45, 6);
  scene.problem.noise_mm = 2;
  const Registration all = scene.registered();
  scene.problem.independent_points = 20;
  const Registration few = scene.registered();
  EXPECT_GT(few.fit.covariance.trace(), 1.5 * all.fit.covariance.trace());
}

TEST(RegisterScan, SaysThatARoundBodyDoesNotFixTheTurn) {
  const Scene scene(round_dome, 35);
  const Registration found = scene.registered();
  const auto weak = weak_directions(found.fit);
  ASSERT_FALSE(weak.empty());
  EXPECT_TRUE(weak.front().turn);
  EXPECT_GT(weak.front().sd, 0.09);
  // A sphere slides over itself: about its centre (the origin) such a turn is within the region.
  Motion turn = Motion::Zero();
  turn[5] = 0.15;
  const RigidTransform turned = found.fit.transform.then(turned_about(Eigen::Vector3d::Zero(), turn));
  EXPECT_LT(mahalanobis_squared(found.fit, turned), chi_squared_quantile(6, 0.95));
  EXPECT_LT(found.fit.pivot.norm(), 15);
}

TEST(RegisterScan, WhatIsRigidFixesThePlaceBetterThanWhatDeforms) {
  Scene scene;
  const Registration soft = scene.registered();
  scene.problem.target.rigid = scene.problem.target.skin;
  scene.problem.target.skin = nullptr;
  const Registration rigid = scene.registered();
  const Eigen::VectorXd soft_variance = soft.fit.covariance.diagonal(),
                        rigid_variance = rigid.fit.covariance.diagonal();
  EXPECT_LT(rigid_variance.head(3).sum(), soft_variance.head(3).sum() / 2);
  EXPECT_LT(rms_off_mm(scene.problem, rigid.fit.transform, {}), 0.6);
}

TEST(RegisterScan, FindsTheSoftnessOfABodyThatMovedFurther) {
  Scene scene;
  scene.add_landmarks();
  Points displacement = Points::Zero(scene.body.points.rows(), 3);
  const auto sag = [](double x, double y) { return -15 * std::exp(-(x * x + y * y) / 1500); };
  for (Eigen::Index p = 0; p < displacement.rows(); ++p)
    displacement(p, 2) = sag(scene.body.points(p, 0), scene.body.points(p, 1));
  scene.problem.target.skin_displacement = displacement;
  constexpr double share = 0.2;
  for (Eigen::Index p = 0; p < scene.problem.points.rows(); ++p)
    scene.problem.points(p, 2) += share * sag(scene.problem.points(p, 0), scene.problem.points(p, 1));
  for (Landmark& l : scene.problem.landmarks) {
    l.displacement.z() = sag(l.scan.x(), l.scan.y());
    l.scan.z() += share * l.displacement.z();
  }
  const Registration found = scene.registered();
  EXPECT_NEAR(found.fit.softness, share, 3 * found.fit.softness_sd + 0.02);
  EXPECT_LT(found.fit.softness_sd, 0.1);
  EXPECT_LT(rms_off_mm(scene.problem, found.fit.transform, {}), 1);
}

std::string complaint_at_scale(double factor, bool landmarks) {
  Scene scene;
  if (landmarks) scene.add_landmarks();
  scene.move(factor * Eigen::Matrix3d::Identity());
  return scene.complaint();
}

TEST(RegisterScan, TellsUnits) {
  const auto tells = [](const std::string& complaint, const char* unit) {
    EXPECT_NE(complaint.find(unit), std::string::npos) << complaint;
  };
  tells(complaint_at_scale(0.001, true), "coordinates are in metres");
  tells(complaint_at_scale(0.1, true), "coordinates are in centimetres");
  tells(complaint_at_scale(1 / 25.4, true), "coordinates are in inches");
  // Without landmarks the size alone cannot tell inches from centimetres.
  tells(complaint_at_scale(1 / 25.4, false), "coordinates are in inches");
}

std::string complaint_after(const Eigen::Matrix3d& change, bool landmarks) {
  Scene scene;
  if (landmarks) scene.add_landmarks();
  scene.move(change);
  return scene.complaint();
}

TEST(RegisterScan, TellsMirrorImagesAndSwappedAxes) {
  const Eigen::Matrix3d negated = Eigen::Vector3d(-1, 1, 1).asDiagonal();
  Eigen::Matrix3d swapped;
  swapped << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  const std::string told = complaint_after(negated, true);
  EXPECT_NE(told.find("is a mirror image"), std::string::npos) << told;
  EXPECT_NE(told.find("x negated"), std::string::npos) << told;
  EXPECT_NE(complaint_after(swapped, true).find("axes swapped (read its x, y, z as y, x, z)"), std::string::npos)
      << complaint_after(swapped, true);
  EXPECT_NE(complaint_after(negated, false).find("is a mirror image"), std::string::npos);
}

TEST(RegisterScan, TellsAndUndoesRas) {
  Scene scene;
  scene.add_landmarks();
  scene.move(Eigen::Vector3d(-1, -1, 1).asDiagonal());
  const Registration found = scene.registered();
  EXPECT_EQ(found.axes, "x and y negated (RAS)");
}

TEST(RegisterScan, RefusesWhatItCannotRegister) {
  Scene empty;
  empty.problem.points.resize(0, 3);
  EXPECT_NE(empty.complaint().find("has no points"), std::string::npos) << empty.complaint();
  Scene nothing;
  nothing.problem.target.skin = nullptr;
  EXPECT_NE(nothing.complaint().find("0 landmarks and no surface"), std::string::npos) << nothing.complaint();
  Scene other;  // crumpled: no place of a smooth body meets it
  for (Eigen::Index p = 0; p < other.problem.points.rows(); ++p)
    other.problem.points(p, 2) =
        60 * std::sin(other.problem.points(p, 0) / 9) * std::sin(other.problem.points(p, 1) / 7);
  other.problem.normals.setZero();
  EXPECT_NE(other.complaint().find("does not fit this body anywhere"), std::string::npos) << other.complaint();
  Scene mixed;
  mixed.add_landmarks();
  for (Landmark& l : mixed.problem.landmarks)
    l.scan = l.image + Eigen::Vector3d(l.image.y(), -l.image.x(), 2 * l.image.y());
  EXPECT_FALSE(mixed.complaint().empty());
}

}  // namespace
}  // namespace supine::registration
