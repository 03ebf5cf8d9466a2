// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/monte_carlo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/error.h"
#include "common/statistics.h"

namespace supine::calibration {
namespace {

simulation::Model study_model() {
  simulation::Model model;
  model.breast.young_modulus_kpa = {0.32, true, 0.4, 1e-3, 1e4};
  model.skin.young_modulus_kpa = {23, true, 40.0, 1e-3, 1e6};
  return model;
}

TEST(MonteCarlo, PriorDrawsArePositiveAndLogNormal) {
  const Draws draws = draw_parameters(FreeParameters(study_model()), DrawKind::prior, 4000, 1);
  EXPECT_EQ(draws.refused, 0);
  std::vector<double> logs;
  double square = 0;
  for (const auto& values : draws.values) {
    ASSERT_GT(values[0], 0);
    logs.push_back(std::log(values[0] / 0.32));
    square += logs.back() * logs.back();
  }
  const double sd = std::log(1 + 0.4 / 0.32);
  EXPECT_NEAR(quantile(logs, 0.5), 0, 5 * 1.2533 * sd / std::sqrt(4000.0));  // of the median, 5 sigma
  EXPECT_NEAR(std::sqrt(square / 4000), sd, 5 * sd / std::sqrt(8000.0));
}

TEST(MonteCarlo, TheStudysNormalLawIsNegativeAThirdOfTheTime) {
  const Draws draws = draw_parameters(FreeParameters(study_model()), DrawKind::normal, 4000, 1);
  for (const auto& values : draws.values) ASSERT_GT(values.minCoeff(), 0);
  // P(both positive) = Φ(0.32/0.4) Φ(23/40) = 0.788 × 0.717 = 0.565.
  const double share = 4000.0 / (4000 + draws.refused);
  EXPECT_NEAR(share, 0.565, 5 * std::sqrt(0.565 * 0.435 / 7000));
}

TEST(MonteCarlo, SameSeedSameDrawsAndFewerAreTheFirstOfMore) {
  const FreeParameters parameters(study_model());
  const Draws some = draw_parameters(parameters, DrawKind::normal, 50, 7);
  const Draws more = draw_parameters(parameters, DrawKind::normal, 80, 7);
  const Draws other = draw_parameters(parameters, DrawKind::normal, 50, 8);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(some.values[i], more.values[i]);
  EXPECT_NE(some.values[0], other.values[0]);
}

TEST(MonteCarlo, SharesOfASumOfKnownVariances) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd x(2000, 3);
  for (double& number : x.reshaped()) number = normal(generator);
  // Variances 4, 1, 0 and an interaction of variance 1: shares 4/6, 1/6, 0.
  const Eigen::VectorXd y =
      2 * x.col(0) + (x.col(1).array().square() / std::sqrt(2.0)).matrix() + x.col(0).cwiseProduct(x.col(2));
  const Eigen::VectorXd shares = first_order_shares(x, y);
  EXPECT_NEAR(shares[0], 4.0 / 6, 0.05);
  EXPECT_NEAR(shares[1], 1.0 / 6, 0.05);
  EXPECT_NEAR(shares[2], 0, 0.03);
}

TEST(MonteCarlo, OneParameterHasAllOfTheVarianceAndNothingVariesNothing) {
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(4, 0, 1);
  EXPECT_EQ(first_order_shares(x, x.array().square().matrix())[0], 1);
  EXPECT_EQ(first_order_shares(x, Eigen::VectorXd::Ones(4))[0], 0);
}

TEST(MonteCarlo, RefusesWhatCannotBeDrawn) {
  simulation::Model model = study_model();
  EXPECT_THROW(draw_parameters(FreeParameters(model), DrawKind::prior, 0, 1), InputError);
  model.skin.young_modulus_kpa.prior_sd.reset();
  EXPECT_THROW(draw_parameters(FreeParameters(model), DrawKind::prior, 10, 1), InputError);
  model = study_model();
  model.breast.young_modulus_kpa = {0.32, true, 1e6, 0.3199, 0.3201};
  EXPECT_THROW(draw_parameters(FreeParameters(model), DrawKind::normal, 10, 1), InputError);
}

}  // namespace
}  // namespace supine::calibration
