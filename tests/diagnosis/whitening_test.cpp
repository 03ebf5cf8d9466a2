// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/whitening.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"
#include "diagnosis/evidence/field_modes.h"
#include "tests/diagnosis/sheet.h"

namespace supine::diagnosis {
namespace {

using supine::testing::sheet;

TEST(Whitening, ErrorsOfClustersBecomeIndependent) {
  const calibration::Residuals r = sheet(6, 300);
  const calibration::Clusters clusters = calibration::cluster_points(r, 300);
  const Eigen::Index n = clusters.members.size();
  EXPECT_EQ(clusters.members.sum(), 300);
  Eigen::MatrixXd sigma = 0.09 * gaussian_kernel(clusters.place, clusters.place, 15);
  sigma.diagonal() += 0.25 * clusters.members.cwiseInverse();
  const Whitening whitening = Whitening::given(clusters, sigma);
  Eigen::MatrixXd by_point(300, n);
  for (int i = 0; i < 300; ++i) by_point.row(i) = sigma.row(clusters.of_point[i]);
  const Eigen::MatrixXd half = whitening.apply(by_point);  // L⁻¹ Σ = Lᵀ
  EXPECT_LT((half.transpose() * half - sigma).norm(), 1e-9 * sigma.norm());
}

TEST(Whitening, RefusesErrorsWithoutNoise) {
  const calibration::Residuals r = sheet(5, 200);
  const calibration::Clusters clusters = calibration::cluster_points(r, 200);
  const Eigen::Index n = clusters.members.size();
  try {
    Whitening::given(clusters, Eigen::MatrixXd::Zero(n, n));
    FAIL() << "points without any error of their own";
  } catch (const NumericalFailure& failure) {
    EXPECT_NE(std::string(failure.what()).find("not positive"), std::string::npos) << failure.what();
  }
}

}  // namespace
}  // namespace supine::diagnosis
