// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "tests/calibration/twin.h"

namespace supine::calibration {
namespace {

using supine::testing::Twin;
using supine::testing::twin_start;
using supine::testing::twin_truth;

struct Fitted {
  explicit Fitted(const simulation::Model& start, double noise_mm = 0.7)
      : twin({twin_truth(), noise_mm}), parameters(start), evaluator(twin.scene(), start) {
    options.noise_mm = {noise_mm};
    fit = fit_least_squares(evaluator, parameters, options);
  }
  Twin twin;
  FreeParameters parameters;
  Evaluator evaluator;
  FitOptions options;
  Fit fit;
};

TEST(Uncertainty, IntervalsHoldTheTruthAsOftenAsTheySayUnderWhiteNoise) {
  Fitted f(twin_truth());
  const Eigen::MatrixXd j = f.fit.linearisation.slope;
  const auto solver = j.colPivHouseholderQr();
  std::mt19937 generator(5);
  std::normal_distribution<double> normal(0, 0.7);
  constexpr int draws = 40;
  Eigen::Vector2i held = Eigen::Vector2i::Zero();
  for (int draw = 0; draw < draws; ++draw) {
    Fit noisy = f.fit;
    Eigen::VectorXd noise(j.rows());
    for (double& number : noise) number = normal(generator);
    const Eigen::VectorXd step = -solver.solve(noise);
    noisy.u = f.fit.u + step;
    noisy.residuals.distance_mm = noise + j * step;
    const Uncertainty worth = judge(noisy, f.parameters, false);
    for (int p = 0; p < 2; ++p) held[p] += std::abs(step[p]) < 1.96 * std::sqrt(worth.covariance(p, p));
  }
  // 95 % of 40 = 38, binomial sd 1.4: four of them. More draws: bench/interval_coverage.cpp.
  for (int p = 0; p < 2; ++p) EXPECT_GE(held[p], 33) << p;
  EXPECT_LT(held.sum(), 80);  // not because the intervals are endless
}

TEST(Uncertainty, SharedErrorsWidenTheIntervals) {
  Fitted f(twin_truth());
  Fit shared = f.fit;
  // A wave of 0.7 mm over the skin that the parameters do not make.
  for (Eigen::Index i = 0; i < shared.residuals.size(); ++i)
    shared.residuals.distance_mm[i] +=
        0.7 * std::sin(shared.residuals.place(i, 0) / 8) * std::cos(shared.residuals.place(i, 2) / 8);
  const Uncertainty alone = judge(f.fit, f.parameters, false), together = judge(shared, f.parameters, false);
  EXPECT_GT(together.errors.spread_mm, alone.errors.spread_mm + 0.2);
  EXPECT_GT(together.covariance(0, 0), 2 * together.white(0, 0));
  EXPECT_LT(together.effective_points, 0.9 * alone.effective_points);
}

TEST(Uncertainty, PriorsCountAsFurtherInformationWhereTheyAreUsed) {
  simulation::Model start = twin_truth();
  start.breast.young_modulus_kpa.prior_sd = 0.001 * start.breast.young_modulus_kpa.value;
  Fitted f(start);
  const Eigen::MatrixXd without = judge(f.fit, f.parameters, false).white,
                        with = judge(f.fit, f.parameters, true).white;
  Eigen::MatrixXd information = without.inverse();
  information.diagonal() += f.parameters.prior_information();
  EXPECT_LT((with - information.inverse()).norm(), 1e-9 * with.norm());
  EXPECT_LT(with(0, 0), 0.5 * without(0, 0));
}

TEST(Uncertainty, LikelihoodsDoNotHoldTheirPrior) {
  simulation::Model start = twin_truth();
  const Fitted alone(start);
  const auto told = likelihoods(alone.fit, alone.parameters, judge(alone.fit, alone.parameters, false), false);
  ASSERT_TRUE(told[0] && told[1]);
  EXPECT_EQ(told[0]->mean, alone.fit.u[0]) << "without priors the fit stands";
  // A prior that is off by a tenth and pulls about as hard as the scan.
  start.breast.young_modulus_kpa.prior_sd = 0.02 * start.breast.young_modulus_kpa.value;
  start.breast.young_modulus_kpa.value *= 1.1;
  const Fitted pulled(start);
  const Uncertainty worth = judge(pulled.fit, pulled.parameters, true);
  const auto without = likelihoods(pulled.fit, pulled.parameters, worth, true);
  const double moved = pulled.fit.u[0] - alone.fit.u[0];
  EXPECT_GT(moved, 0.003) << "the prior does not pull: the test shows nothing";
  EXPECT_NEAR(without[0]->mean, alone.fit.u[0], 0.2 * moved);
  EXPECT_NEAR(without[0]->sd, told[0]->sd, 0.1 * told[0]->sd);
  EXPECT_GT(without[0]->sd, std::sqrt(worth.covariance(0, 0)));
  EXPECT_LT(without[1]->sd, told[1]->sd) << "of the other parameter the prior stays";
}

TEST(Uncertainty, WhatTheScanSaysNothingOfHasNoLikelihood) {
  Fitted f(twin_truth());
  f.fit.linearisation.slope.col(0) *= 1e-6;
  f.fit.information.row(0) *= 1e-6, f.fit.information.col(0) *= 1e-6;
  const auto told = likelihoods(f.fit, f.parameters, judge(f.fit, f.parameters, false), false);
  EXPECT_FALSE(told[0]);
  EXPECT_TRUE(told[1]);
}

TEST(Uncertainty, ModulusAndThicknessOfTheSkinCannotBeToldApart) {
  simulation::Model start = twin_truth();
  start.skin.thickness_mm = {1.5, true, {}, 0.3, 5};
  Fitted f(start);
  const Uncertainty worth = judge(f.fit, f.parameters, false);
  EXPECT_EQ(worth.rank, 2);
  bool found = false;
  for (const auto& pair : worth.not_told_apart)
    found |= pair.first == "skin.young_modulus_kpa" && pair.second == "skin.thickness_mm" && pair.correlation < -0.99;
  EXPECT_TRUE(found);
}

TEST(Uncertainty, ProfileOfAWellMeasuredParameterIsTheLinearInterval) {
  simulation::Model start = twin_start();
  start.skin.young_modulus_kpa.free = false;
  start.skin.young_modulus_kpa.value = 25;
  Fitted f(start);
  const Uncertainty worth = judge(f.fit, f.parameters, false);
  const auto linear = linear_intervals(f.fit, f.parameters, worth);
  const Profile profile = profile_interval(f.evaluator, f.parameters, f.options, f.fit, worth, 0);
  EXPECT_GT(profile.runs, 1);
  const double width = linear[0].high - linear[0].low;
  EXPECT_NEAR(profile.interval.low, linear[0].low, 0.1 * width);
  EXPECT_NEAR(profile.interval.high, linear[0].high, 0.1 * width);
  EXPECT_LT(linear[0].low, 0.9);
  EXPECT_GT(linear[0].high, 0.9);
}

TEST(Uncertainty, ProfileOfTwoHoldsTheTruth) {
  Fitted f(twin_start());
  const Uncertainty worth = judge(f.fit, f.parameters, false);
  // The second first: neither depends on the other.
  const Profile skin = profile_interval(f.evaluator, f.parameters, f.options, f.fit, worth, 1);
  const Profile tissue = profile_interval(f.evaluator, f.parameters, f.options, f.fit, worth, 0);
  EXPECT_LT(tissue.interval.low, 0.9);
  EXPECT_GT(tissue.interval.high, 0.9);
  EXPECT_LT(skin.interval.low, 25);
  EXPECT_GT(skin.interval.high, 25);
}

}  // namespace
}  // namespace supine::calibration
