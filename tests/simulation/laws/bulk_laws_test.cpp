// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/laws/bulk_laws.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "simulation/catalogue.h"
#include "simulation/terms/bulk.h"
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
  std::array<double, 2> shape{};
};

class BulkLawTest : public ::testing::TestWithParam<Case> {
 protected:
  BulkLawTest() { material.shape = GetParam().shape; }
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

TEST_P(BulkLawTest, TheNegativePartOfTheTangentIsTakenOffAndNoMore) {
  if (!has_energy) return;
  Matrix3 p;
  Tangent9 tangent;
  bulk_tangent(law, stretched() * Eigen::Vector3d(1, 1, 0.3).asDiagonal(), material, rest, p, tangent);
  const Eigen::SelfAdjointEigenSolver<Tangent9> eigen(tangent);
  ASSERT_LT(eigen.eigenvalues()[0], -1e-3 * tangent.norm()) << "nothing to take off";
  const double volume = 2;
  ElementSums<3> added;
  added.clear(Demand{.tangent = true});
  take_off_negative_curvature<3>(tangent, unit_gradients, volume, added);
  const Tangent9 convex = tangent + point_tangent(added, true) / volume;
  const Tangent9 expected =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
  EXPECT_LT((convex - expected).norm(), 1e-12 * tangent.norm());
}

TEST_P(BulkLawTest, StressTurnsWithTheBody) {
  const Matrix3 f = stretched(3);
  const Matrix3 turn = Eigen::AngleAxisd(2.0, Eigen::Vector3d(0.3, 1, 2).normalized()).toRotationMatrix();
  EXPECT_LT((stress(turn * f) - turn * stress(f)).norm(), 1e-12);
}

TEST_P(BulkLawTest, StressFollowsItsMaterial) {
  const Matrix3 f = stretched(5);
  const auto material_at = [&](const auto& h) {
    using std::exp;
    using T = std::decay_t<decltype(h)>;
    auto moved = bulk_material<T>(0.5 * exp(h), 0.4 + 0.3 * h, 0.2 + h);
    moved.shape = {GetParam().shape[0] * (1.0 + 0.4 * h), GetParam().shape[1] * (1.0 - 0.7 * h)};
    return moved;
  };
  const auto at = [&](double h) { return bulk_stress<double>(law, f, material_at(h), rest); };
  const BulkMaterial<Dual> moving = material_at(Dual(0.0, 0));
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
                                           Case{BulkLaw::mooney_rivlin, 0, {0.4, 0}},
                                           Case{BulkLaw::yeoh, 0, {0.8, 0.3}}, Case{BulkLaw::gent, 0, {2.5, 0}},
                                           Case{BulkLaw::neo_hookean_calculix, 0}, Case{BulkLaw::corotational, 0},
                                           Case{BulkLaw::corotational_qr, 0}));

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

// Values worked out by hand from the energies of the header, E = 0.5, ν = 0.45, so μ = 5/29 and λ = 45/29.
struct Worked {
  BulkLaw law;
  std::array<double, 2> shape;
  /// dW/dI1, dW/dI2 and W_L of a state, as the formulas give them.
  std::array<double, 3> (*slopes)(double mu, double lambda, double i1, double log_j, double j);
};

class WorkedLaw : public ::testing::TestWithParam<Worked> {
 protected:
  static constexpr double mu = 5.0 / 29, lambda = 45.0 / 29;
  Matrix3 stress(const Matrix3& f) const {
    BulkMaterial<double> m = bulk_material<double>(0.5, 0.45, 0);
    m.shape = GetParam().shape;
    return bulk_stress<double>(GetParam().law, f, m, rest);
  }
};

// Principal stretches a, b, c: P_1 = 2 a W1 + 2 a (b² + c²) W2 + W_L / a.
TEST_P(WorkedLaw, StretchedAlongItsAxes) {
  for (const Eigen::Vector3d& s :
       {Eigen::Vector3d(1.4, 1, 1), Eigen::Vector3d(1.2, 1.2, 1.2), Eigen::Vector3d(0.7, 1.1, 1.3)}) {
    const double j = s.prod(), log_j = std::log(j);
    const auto [w1, w2, wl] = GetParam().slopes(mu, lambda, s.squaredNorm(), log_j, j);
    const Matrix3 p = stress(s.asDiagonal());
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(p(i, i), 2 * s[i] * w1 + 2 * s[i] * (s.squaredNorm() - s[i] * s[i]) * w2 + wl / s[i], 1e-12);
    EXPECT_NEAR((p - Matrix3(p.diagonal().asDiagonal())).norm(), 0, 1e-13);
  }
}

// F = 1 + γ e1 e2ᵀ: J = 1, I1 = I2 = 3 + γ²; Cauchy shear σ12 = 2 γ (W1 + W2) whatever the volumetric part, and
// the universal relation of Rivlin σ11 - σ22 = γ σ12.
TEST_P(WorkedLaw, SimpleShear) {
  const double gamma = 0.6;
  Matrix3 f = Matrix3::Identity();
  f(0, 1) = gamma;
  const auto [w1, w2, wl] = GetParam().slopes(mu, lambda, 3 + gamma * gamma, 0, 1);
  const Matrix3 cauchy = stress(f) * f.transpose();
  EXPECT_NEAR(cauchy(0, 1), 2 * gamma * (w1 + w2), 1e-13);
  EXPECT_NEAR(cauchy(0, 0) - cauchy(1, 1), gamma * cauchy(0, 1), 1e-13);
  EXPECT_GT(cauchy(0, 1), mu * gamma * 0.999);  // none softens in shear
}

double k_of(double i1, double log_j) { return i1 - 3 - 2 * log_j; }

INSTANTIATE_TEST_SUITE_P(
    Laws, WorkedLaw,
    ::testing::Values(Worked{BulkLaw::neo_hookean,
                             {},
                             [](double mu, double lambda, double, double log_j, double) {
                               return std::array{mu / 2, 0.0, -mu + lambda * log_j};
                             }},
                      Worked{BulkLaw::mooney_rivlin,
                             {0.4, 0},
                             [](double mu, double lambda, double, double log_j, double) {
                               const double c10 = 0.3 * mu, c01 = 0.2 * mu;
                               return std::array{c10, c01, -2 * c10 - 4 * c01 + (lambda - 4 * c01) * log_j};
                             }},
                      Worked{BulkLaw::yeoh,
                             {0.8, 0.3},
                             [](double mu, double lambda, double i1, double log_j, double) {
                               const double k = k_of(i1, log_j);
                               const double slope = mu / 2 * (1 + 2 * 0.8 * k + 3 * 0.3 * k * k);
                               return std::array{slope, 0.0, -2 * slope + lambda * log_j};
                             }},
                      Worked{BulkLaw::gent,
                             {2.5, 0},
                             [](double mu, double lambda, double i1, double log_j, double) {
                               const double slope = mu / 2 * 2.5 / (2.5 - k_of(i1, log_j));
                               return std::array{slope, 0.0, -2 * slope + lambda * log_j};
                             }},
                      Worked{
                          BulkLaw::neo_hookean_calculix, {}, [](double mu, double lambda, double i1, double, double j) {
                            const double share = std::pow(j, -2.0 / 3), kappa = lambda + 2 * mu / 3;
                            return std::array{mu / 2 * share, 0.0, -mu / 3 * share * i1 + kappa * j * (j - 1)};
                          }}));

// Uniaxial stress of the nearly incompressible solid: the textbook's σ = 2 (s² - 1/s) (W1 + W2/s).
TEST(NearlyIncompressible, UniaxialStressIsTheTextbooks) {
  const double s = 1.5, nu = 0.499999, i1 = s * s + 2 / s, mu = 0.5 / (2 * (1 + nu));
  const auto cauchy_stress = [&](BulkLaw law, const std::array<double, 2>& shape) {
    BulkMaterial<double> m = bulk_material<double>(0.5, nu, 0);
    m.shape = shape;
    double wide = 1 / std::sqrt(s);
    for (int i = 0; i < 50; ++i) {  // secant on the lateral stress
      const auto lateral = [&](double w) {
        return bulk_stress<double>(law, Eigen::Vector3d(s, w, w).asDiagonal(), m, rest)(1, 1);
      };
      const double h = 1e-7;
      wide -= lateral(wide) * h / (lateral(wide + h) - lateral(wide));
    }
    return bulk_stress<double>(law, Eigen::Vector3d(s, wide, wide).asDiagonal(), m, rest)(0, 0) / (wide * wide);
  };
  const double way = 2 * (s * s - 1 / s);
  EXPECT_NEAR(cauchy_stress(BulkLaw::neo_hookean, {}), way * mu / 2, 1e-5);
  EXPECT_NEAR(cauchy_stress(BulkLaw::neo_hookean_calculix, {}), way * mu / 2, 1e-5);
  EXPECT_NEAR(cauchy_stress(BulkLaw::mooney_rivlin, {0.4, 0}), way * mu / 2 * (0.6 + 0.4 / s), 1e-5);
  const double k = i1 - 3;
  EXPECT_NEAR(cauchy_stress(BulkLaw::yeoh, {0.8, 0.3}), way * mu / 2 * (1 + 1.6 * k + 0.9 * k * k), 1e-5);
  EXPECT_NEAR(cauchy_stress(BulkLaw::gent, {2.5, 0}), way * mu / 2 * 2.5 / (2.5 - k), 1e-5);
}

TEST(Gent, HasNoEnergyBeyondItsLimit) {
  BulkMaterial<double> m = bulk_material<double>(0.5, 0.45, 0);
  m.shape = {0.5, 0};
  const auto margin = [&m](double s) {
    return law_margin(BulkLaw::gent, InvariantStrain(Eigen::Vector3d(s, 1, 1).asDiagonal()), m);
  };
  EXPECT_EQ(margin(1), 1);
  EXPECT_GT(margin(1.4), 0);  // K = 1.96 - 1 - 2 ln 1.4 = 0.287
  EXPECT_LT(margin(1.7), 0);  // K = 2.89 - 1 - 2 ln 1.7 = 0.829
  EXPECT_EQ(law_margin(BulkLaw::yeoh, InvariantStrain(Matrix3(3 * Matrix3::Identity())), m), 1);
}

TEST(SplitLambda, LeavesModerateTissueAloneAndIsSmooth) {
  const auto excess = [](double over_mu) {
    return split_lambda(BulkMaterial<double>{0.4, 0.4 * over_mu, 0, {}}).excess / 0.4;
  };
  EXPECT_EQ(excess(1), 0);
  EXPECT_EQ(excess(pointwise_lambda_over_mu), 0);
  EXPECT_NEAR(excess(pointwise_lambda_over_mu * (1 + 1e-4)), 0, 1e-6);  // of second order at the knee
  EXPECT_GT(excess(500), 470);
  const BulkMaterial<Dual> moving{Dual(0.4), Dual(1.6, 0), Dual(0.0), {}};
  EXPECT_GT(taylor_order(
                [](double h) {
                  return split_lambda(BulkMaterial<double>{0.4, 1.6 + h, 0, {}}).excess;
                },
                split_lambda(moving).excess.v[0]),
            1.9);
}

}  // namespace
}  // namespace supine::simulation
