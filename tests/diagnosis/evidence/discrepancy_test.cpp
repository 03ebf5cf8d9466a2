// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/discrepancy.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "diagnosis/evidence/field_modes.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/solve/sensitivities.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Two scans of one pose, the same points in both, as if of two poses.
class DiscrepancyOfATwin : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::Twin twin({testing::twin_truth()}), again({testing::twin_truth()});
    again.measurement->pose.name = "again";
    calibration::MeasuredScene scene = twin.scene();
    scene.measurements.push_back(again.measurement.get());
    calibration::Evaluator evaluator(scene, testing::twin_truth(), accurate_enough());
    const calibration::Prediction prediction = evaluator.predict(testing::twin_truth());
    const auto residuals = residuals_of(scene, prediction, points_over_skin(prediction), {0.3, 0.3});
    clusters = new calibration::Clusters(calibration::cluster_points(residuals, 150));
    simulation::Sensitivities sensitivities(evaluator.chain(), testing::twin_truth(), prediction.solution);
    found = new Discrepancy(discrepancy_of(twin.mesh, sensitivities, prediction, residuals, *clusters));
  }
  static void TearDownTestSuite() {
    delete found;
    delete clusters;
  }
  static MatrixXd beyond_forces() {
    MatrixXd all = MatrixXd::Zero(found->kernel.rows(), found->kernel.cols());
    for (Index i = 0; i < all.rows(); ++i)
      for (Index j = 0; j < all.cols(); ++j)
        if (clusters->pose[i] == clusters->pose[j])
          all(i, j) = share_beyond_forces *
                      gaussian_kernel(clusters->place.row(i), clusters->place.row(j), beyond_forces_length_mm)(0, 0);
    return all;
  }
  static Discrepancy* found;
  static calibration::Clusters* clusters;
};
Discrepancy* DiscrepancyOfATwin::found = nullptr;
calibration::Clusters* DiscrepancyOfATwin::clusters = nullptr;

TEST_F(DiscrepancyOfATwin, IsACovarianceOfOneMillimetre) {
  const MatrixXd& k = found->kernel;
  EXPECT_LT((k - k.transpose()).norm(), 1e-12 * k.norm());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(k, Eigen::EigenvaluesOnly);
  EXPECT_GT(eigen.eigenvalues().minCoeff(), -1e-9 * eigen.eigenvalues().maxCoeff());
  EXPECT_NEAR(k.trace(), static_cast<double>(k.rows()), 1e-9 * static_cast<double>(k.rows()));
}

TEST_F(DiscrepancyOfATwin, IsWhatItsForcesDoHalfOfItInAllPosesAndATenthBeyond) {
  const MatrixXd forces = found->columns * found->columns.transpose();
  const MatrixXd left = found->kernel - beyond_forces();
  for (Index i = 0; i < left.rows(); ++i)
    for (Index j = 0; j < left.cols(); ++j)
      ASSERT_NEAR(left(i, j), (clusters->pose[i] == clusters->pose[j] ? 1 : common_to_poses) * forces(i, j), 1e-9)
          << i << ", " << j;
  EXPECT_NEAR(forces.trace(), (1 - share_beyond_forces) * static_cast<double>(left.rows()), 1e-9 * left.rows());
}

TEST_F(DiscrepancyOfATwin, DoesTheSameToTheSamePointsOfBothPoses) {
  const Index half = found->columns.rows() / 2;
  ASSERT_EQ(clusters->pose.head(half).maxCoeff(), 0);
  ASSERT_EQ(clusters->pose.tail(half).minCoeff(), 1);
  EXPECT_LT((found->columns.topRows(half) - found->columns.bottomRows(half)).norm(), 1e-6 * found->columns.norm());
}

}  // namespace
}  // namespace supine::diagnosis
