// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/field_modes.h"

#include <gtest/gtest.h>

#include <random>

namespace supine::diagnosis {
namespace {

Points cloud(int count) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-40, 40);
  Points points(count, 3);
  for (int i = 0; i < count; ++i) points.row(i) << uniform(generator), uniform(generator), 0.2 * uniform(generator);
  return points;
}

TEST(FieldModes, MakeTheKernelTheyComeFrom) {
  const Points points = cloud(300);
  const Eigen::MatrixXd modes = field_modes(points, 25);
  const Eigen::MatrixXd kernel = gaussian_kernel(points, points, 25);
  EXPECT_LT((modes * modes.transpose() - kernel).cwiseAbs().maxCoeff(), 0.1);
  EXPECT_GT(modes.rowwise().squaredNorm().mean(), 0.97) << "of a variance of one";
  for (Eigen::Index k = 1; k < modes.cols(); ++k) EXPECT_LE(modes.col(k).norm(), 1.3 * modes.col(k - 1).norm());
}

TEST(FieldModes, AreMoreWhereMoreVaries) {
  const Points small = cloud(400), large = 2 * small;
  const Eigen::MatrixXd of_small = field_modes(small, 20), of_large = field_modes(large, 20);
  EXPECT_GT(of_large.cols(), 2 * of_small.cols());
  EXPECT_GT(of_large.rowwise().squaredNorm().mean(), 0.95);
}

TEST(FieldModes, AreAsManyAsWereAskedForAtTheMost) { EXPECT_EQ(field_modes(cloud(200), 10, 12).cols(), 12); }

TEST(FieldModes, SpreadOutTakesEveryPointOnceAndStopsWherePointsCoincide) {
  Points points(4, 3);
  points << 0, 0, 0, 10, 0, 0, 0, 0, 0, 4, 0, 0;
  EXPECT_EQ(spread_out(points, 10), (std::vector{0, 1, 3}));
}

TEST(FieldModes, WithoutTakesTheShapeOutUnderTheWeight) {
  const Points points = cloud(100);
  const Eigen::VectorXd weight = points.col(0).cwiseAbs(), shape = Eigen::VectorXd::Ones(100);
  const Eigen::MatrixXd rest = without(shape, weight, field_modes(points, 25));
  EXPECT_LT((weight.transpose() * rest).cwiseAbs().maxCoeff(), 1e-9 * weight.sum());
}

}  // namespace
}  // namespace supine::diagnosis
