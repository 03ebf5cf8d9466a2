// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/bulk_laws.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "simulation/catalogue.h"
#include "tests/support/taylor.h"

namespace supine::simulation {
namespace {

using testing::random_matrix;
using testing::taylor_order;

const Eigen::Matrix<double, 3, 2> rest = (Eigen::Matrix<double, 3, 2>() << 1, 0.2, 0.1, 1.3, -0.2, 0.4).finished();

Matrix3 stretched(unsigned seed = 1) {
  const Matrix3 turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  return turn * (Matrix3::Identity() + 0.25 * random_matrix(3, 3, seed));
}

struct Case {
  BulkLaw law;
  double stiffening;
};

class BulkLawTest : public ::testing::TestWithParam<Case> {
 protected:
  BulkMaterial<double> material = bulk_material<double>(0.5, 0.45, GetParam().stiffening);
  BulkLaw law = GetParam().law;
  bool has_energy = law != BulkLaw::corotational_qr;
  Matrix3 stress(const Matrix3& f) const { return bulk_stress<double>(law, f, material, rest); }
};

TEST_P(BulkLawTest, NoStressAndNoEnergyAtRestOrUnderRotation) {
  const Matrix3 turn = Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, -1, 3).normalized()).toRotationMatrix();
  for (const Matrix3& f : {Matrix3(Matrix3::Identity()), turn}) {
    EXPECT_LT(stress(f).norm(), 1e-13);
    if (has_energy) {
      EXPECT_NEAR(bulk_energy(law, f, material), 0, 1e-13);
    }
  }
}

TEST_P(BulkLawTest, StressIsTheDerivativeOfTheEnergy) {
  if (!has_energy) return;
  const Matrix3 f = stretched(), v = random_matrix(3, 3, 7);
  const double slope = stress(f).cwiseProduct(v).sum();
  ASSERT_GT(std::abs(slope), 1e-3);
  EXPECT_GT(taylor_order([&](double h) { return bulk_energy(law, f + h * v, material); }, slope), 1.9);
}

TEST_P(BulkLawTest, TangentIsTheDerivativeOfTheStress) {
  const Matrix3 f = stretched(), v = random_matrix(3, 3, 8);
  Matrix3 p;
  Tangent9 a;
  bulk_tangent(law, f, material, rest, p, a);
  EXPECT_LT((p - stress(f)).norm(), 1e-13);
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> v_rows = v;
  const Eigen::Matrix<double, 9, 1> flat = a * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(v_rows.data());
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> slope =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(flat.data());
  ASSERT_GT(slope.norm(), 1e-3);
  EXPECT_GT(taylor_order([&](double h) { return stress(f + h * v); }, Matrix3(slope)), 1.9);
  if (has_energy) {
    EXPECT_LT((a - a.transpose()).norm(), 1e-12 * a.norm());
  }
}

TEST_P(BulkLawTest, StressTurnsWithTheBody) {
  const Matrix3 f = stretched(3);
  const Matrix3 turn = Eigen::AngleAxisd(2.0, Eigen::Vector3d(0.3, 1, 2).normalized()).toRotationMatrix();
  EXPECT_LT((stress(turn * f) - turn * stress(f)).norm(), 1e-12);
}

TEST_P(BulkLawTest, StressFollowsItsMaterial) {
  const Matrix3 f = stretched(5);
  const auto at = [&](double h) {
    return bulk_stress<double>(law, f, bulk_material<double>(0.5 * std::exp(h), 0.4 + 0.3 * h, 0.2 + h), rest);
  };
  const BulkMaterial<Dual> moving =
      bulk_material<Dual>(0.5 * ceres::exp(Dual(0.0, 0)), 0.4 + 0.3 * Dual(0.0, 0), 0.2 + Dual(0.0, 0));
  const auto p = bulk_stress<Dual>(law, f, moving, rest);
  Matrix3 slope;
  for (int i = 0; i < 9; ++i) slope(i / 3, i % 3) = p(i / 3, i % 3).v[0];
  EXPECT_GT(taylor_order(at, slope), 1.9);
}

TEST_P(BulkLawTest, SmallStrainIsHookes) {
  const Matrix3 e = 1e-6 * (random_matrix(3, 3, 9) + random_matrix(3, 3, 9).transpose());
  // Stiffening acts on I1, which the volume enters: it adds 2 b μ to λ from the start.
  const double lambda = material.lambda_kpa + 2 * material.stiffening * material.mu_kpa;
  const Matrix3 hooke = 2 * material.mu_kpa * e + lambda * e.trace() * Matrix3::Identity();
  EXPECT_LT((stress(Matrix3::Identity() + e) - hooke).norm(), 1e-4 * hooke.norm());
}

INSTANTIATE_TEST_SUITE_P(Laws, BulkLawTest,
                         ::testing::Values(Case{BulkLaw::neo_hookean, 0}, Case{BulkLaw::neo_hookean, 1.5},
                                           Case{BulkLaw::corotational, 0}, Case{BulkLaw::corotational_qr, 0}));

TEST(PolarRotation, IsTheNearestRotation) {
  const Matrix3 f = stretched(11), r = polar_rotation(f);
  EXPECT_LT((r.transpose() * r - Matrix3::Identity()).norm(), 1e-14);
  EXPECT_NEAR(r.determinant(), 1, 1e-14);
  EXPECT_LT((r.transpose() * f - f.transpose() * r).norm(), 1e-13);
}

TEST(CorotationalQr, DependsOnTheOrderOfCornersAndPolarDoesNot) {
  const Matrix3 f = stretched(2);
  const BulkMaterial<double> m = bulk_material<double>(0.5, 0.45, 0);
  Eigen::Matrix<double, 3, 2> swapped;
  swapped << rest.col(1), rest.col(0);
  const auto difference = [&](BulkLaw law) {
    return (bulk_stress<double>(law, f, m, rest) - bulk_stress<double>(law, f, m, swapped)).norm();
  };
  EXPECT_GT(difference(BulkLaw::corotational_qr), 1e-3);
  EXPECT_EQ(difference(BulkLaw::corotational), 0);
}

TEST(CorotationalQr, RestDerivativeIsRight) {
  const Matrix3 f = stretched(4);
  const BulkMaterial<double> m = bulk_material<double>(0.5, 0.45, 0);
  const Eigen::MatrixXd v = random_matrix(3, 2, 5);
  const auto d = qr_rest_derivative(f, m, rest);
  Eigen::Matrix<double, 6, 1> direction;
  direction << v.col(0), v.col(1);
  const Eigen::Matrix<double, 9, 1> flat = d * direction;
  Matrix3 slope;
  for (int i = 0; i < 9; ++i) slope(i / 3, i % 3) = flat[i];
  ASSERT_GT(slope.norm(), 1e-3);
  EXPECT_GT(
      taylor_order([&](double h) { return bulk_stress<double>(BulkLaw::corotational_qr, f, m, rest + h * v); }, slope),
      1.9);
}

}  // namespace
}  // namespace supine::simulation
