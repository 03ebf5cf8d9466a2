// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace supine {

TEST(Statistics, QuantileIsLinearBetweenOrderStatistics) {
  EXPECT_DOUBLE_EQ(quantile({4, 1, 3, 2}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({4, 1, 3, 2}, 0.95), 3.85);
  EXPECT_DOUBLE_EQ(quantile({4, 1, 3, 2}, 0), 1);
  EXPECT_DOUBLE_EQ(quantile({4, 1, 3, 2}, 1), 4);
  EXPECT_DOUBLE_EQ(quantile({7}, 0.95), 7);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
  EXPECT_DOUBLE_EQ(median(Eigen::Vector4d(4, 1, 3, 2)), 2.5);
  EXPECT_DOUBLE_EQ(median(Eigen::Vector3d(9, 1, 3)), 3);
}

TEST(Statistics, NormalQuantilesOfTheTables) {
  EXPECT_NEAR(normal_quantile(0.5), 0, 1e-15);
  EXPECT_NEAR(normal_quantile(0.75), 0.674489750196082, 1e-14);
  EXPECT_NEAR(normal_quantile(0.025), -1.959963984540054, 1e-14);
  EXPECT_NEAR(normal_reach95(), 1.959963984540054, 1e-14);
}

TEST(Statistics, ChiSquaredQuantilesAndTailsOfTheTables) {
  EXPECT_NEAR(chi_squared_quantile(1, 0.95), 3.841458820694124, 1e-13);
  EXPECT_NEAR(chi_squared_quantile(10, 0.95), 18.30703805327515, 1e-12);
  EXPECT_NEAR(chi_squared_quantile(2, 0.5), 2 * std::log(2), 1e-14);
  EXPECT_NEAR(chi_squared_above(2, 3), std::exp(-1.5), 1e-15);
  EXPECT_NEAR(chi_squared_above(28, 48.278), 0.01, 1e-4);
  EXPECT_EQ(chi_squared_above(5, 0), 1);
  EXPECT_EQ(chi_squared_above(0, 3), 1);
  EXPECT_EQ(chi_squared_power(0, 3, 3), 0);
  EXPECT_NEAR(chi_squared_power(1, 7.849, 3.8415), 0.8, 1e-3);
}

TEST(Statistics, BasisSpansTheColumnsAndNothingElse) {
  Eigen::MatrixXd columns(4, 3);
  columns << 1, 2, 3, 0, 1, 1, 2, 0, 2, 1, 1, 2;  // the third is the sum of the others
  const Eigen::MatrixXd q = orthonormal_basis(columns);
  ASSERT_EQ(q.cols(), 2);
  EXPECT_TRUE((q.transpose() * q).isIdentity(1e-14));
  EXPECT_LT((columns - q * (q.transpose() * columns)).norm(), 1e-13);
  EXPECT_EQ(orthonormal_basis(Eigen::MatrixXd(4, 0)).cols(), 0);
}

}  // namespace supine
