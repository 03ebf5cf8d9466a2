// SPDX-License-Identifier: AGPL-3.0-or-later
// The discrepancy's covariance over what a fit leaves open.
#include "diagnosis/evidence/mean_kernel.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "diagnosis/weighted_fit.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using Eigen::MatrixXd;
using supine::testing::Twin;

TEST(MeanKernel, IsAsFarFromThatOfTheFitAsNumbersAreOpen) {
  constexpr double noise_mm = 0.3;
  const Twin twin({supine::testing::twin_truth(), noise_mm});
  const simulation::Model start = supine::testing::twin_start();
  calibration::Evaluator evaluator(twin.scene(), start, accurate_enough());
  BaseFitOptions options;
  options.other_meshes = false;
  BaseFit base = fit_base_model(evaluator, start, start, {noise_mm}, nullptr, options);
  ASSERT_LT(base.size_mm, least_size_of_mean_kernel_mm) << "nothing is missing: the kernel is that of the fit";
  const auto away = [&] {
    const MatrixXd mean = mean_kernel(twin.scene(), base);
    EXPECT_NEAR(mean.diagonal().mean(), 1, 0.05);
    EXPECT_LT((mean - mean.transpose()).norm(), 1e-9 * mean.norm());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(mean).eigenvalues()[0], -1e-9 * mean.norm());
    return (mean - base.kernel).norm() / base.kernel.norm();
  };
  const double known = away();
  constexpr double poorer = 5;  // than the scan is
  base.errors *= poorer * poorer;
  base.covariance = std::make_unique<ErrorCovariance>(base.errors, base.kernel, base.scale_mm, base.most_mm);
  EXPECT_LT(known, 0.05);
  EXPECT_GT(away(), 2 * known);
}

}  // namespace
}  // namespace supine::diagnosis
