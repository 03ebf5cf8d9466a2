// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/scan_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/calibration/shapes.h"
#include "tests/support/taylor.h"

namespace supine::calibration {
namespace {

using supine::testing::random_points;

Eigen::VectorXd some_motion() {
  Eigen::VectorXd motion(6);
  motion << 3, -2, 1, 0.1, -0.05, 0.2;
  return motion;
}

TEST(ScanMotion, TakesBackWhatMovedTheTrueScan) {
  const Points truth = random_points(50, -40, 90, 3);
  const Eigen::Vector3d centre = truth.colwise().mean(), turn = some_motion().tail<3>();
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  Points given(truth.rows(), 3);
  for (Eigen::Index i = 0; i < truth.rows(); ++i)
    given.row(i) = (centre + rotation * (truth.row(i).transpose() - centre) + some_motion().head<3>()).transpose();
  const ScanMotion motion(some_motion(), given);
  EXPECT_LT((motion.corrected(given) - truth).norm(), 1e-10);
  EXPECT_LT((motion.as_given(truth) - given).norm(), 1e-10);
  const Points directions = random_points(5, -1, 1, 4);
  EXPECT_LT((motion.directions_as_given(directions) - directions * rotation.transpose()).norm(), 1e-12);
}

TEST(ScanMotion, NoneLeavesEveryBit) {
  const Points scan = random_points(20, 0, 50, 5);
  const ScanMotion none(Eigen::VectorXd::Zero(6), scan);
  EXPECT_EQ(none.corrected(scan), scan);
}

TEST(ScanMotion, DerivativeIsThatOfTheCorrectedPoints) {
  const Points scan = random_points(20, -40, 90, 6);
  for (const Eigen::VectorXd& at : {Eigen::VectorXd(Eigen::VectorXd::Zero(6)), some_motion()})
    for (int k = 3; k < 6; ++k) {
      simulation::Fields<simulation::Dual>::Column dual = at.cast<simulation::Dual>();
      dual[k].v[0] = 1;
      const auto moved = [&](double h) -> Points {
        Eigen::VectorXd motion = at;
        motion[k] += h;
        return ScanMotion(motion, scan).corrected(scan);
      };
      EXPECT_GT(supine::testing::taylor_order(moved, corrected_derivative(dual, scan, scan), 0.05), 1.9) << k;
    }
}

TEST(ScanMotion, ShiftMovesEveryPointAlike) {
  const Points scan = random_points(20, -40, 90, 7);
  simulation::Fields<simulation::Dual>::Column dual = some_motion().cast<simulation::Dual>();
  dual[1].v[0] = 1;
  EXPECT_LT((corrected_derivative(dual, scan, scan).rowwise() - Eigen::RowVector3d(0, -1, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace supine::calibration
