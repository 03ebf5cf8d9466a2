// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/score_test.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

#include "common/error.h"
#include "common/statistics.h"
#include "tests/diagnosis/sheet.h"

namespace supine::diagnosis {
namespace {

using calibration::Residuals;

using supine::testing::sheet;

Eigen::MatrixXd fitted_slopes(const Residuals& r) {
  Eigen::MatrixXd slope(r.size(), 2);
  slope.col(0).setOnes();
  slope.col(1) = r.place.col(0) / 40;
  return slope;
}

Eigen::VectorXd no_mean(const Residuals& r) { return Eigen::VectorXd::Zero(r.size()); }

Candidate candidate(const std::string& name, const Eigen::MatrixXd& slope, bool one_sided = false) {
  Candidate c{name, {}, slope};
  for (Eigen::Index k = 0; k < slope.cols(); ++k)
    c.parameters.push_back({name + ".p" + std::to_string(k), "1", 0, one_sided ? 0.0 : -2.0, 2, 0.5, one_sided});
  return c;
}

/// Shapes that recalibration cannot make.
std::vector<Candidate> catalogue_of(const Residuals& r) {
  const Eigen::ArrayXd x = r.place.col(0).array() / 20, y = r.place.col(1).array() / 20;
  Eigen::MatrixXd two(r.size(), 2);
  two << x.cos().matrix(), (2 * y).sin().matrix();
  return {candidate("wave", y.sin().matrix()), candidate("pair", two),
          candidate("ring", (-(x * x + y * y) / 2).exp().matrix(), true)};
}

const Score& score_of(const ScoreTable& table, const std::string& effect) {
  for (const Score& score : table.scores)
    if (score.effect == effect) return score;
  throw InputError(effect);
}

/// Weighted sum of squares after a fit of these columns.
double left_over(const Residuals& r, const Eigen::MatrixXd& columns) {
  const Eigen::VectorXd d = r.distance_mm - columns * columns.colPivHouseholderQr().solve(r.distance_mm);
  return d.squaredNorm() / (0.5 * 0.5);
}

TEST(ScoreTest, StatisticIsTheFallOfTheSumOfSquares) {
  const Residuals r = sheet(1);
  const auto candidates = catalogue_of(r);
  const ScoreTable table = score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1);
  for (const Candidate& c : candidates) {
    if (score_of(table, c.effect).wrong_sign) continue;
    Eigen::MatrixXd both(r.size(), 2 + c.slope.cols());
    both << fitted_slopes(r), c.slope;
    const double fall = left_over(r, fitted_slopes(r)) - left_over(r, both);
    EXPECT_NEAR(score_of(table, c.effect).statistic, fall, 1e-8 * (1 + fall)) << c.effect;
  }
}

TEST(ScoreTest, FindsWhatIsThereWithItsSizeAndTheFallItPredicts) {
  Residuals r = sheet(2);
  const auto candidates = catalogue_of(r);
  r.distance_mm -= 0.6 * candidates[0].slope;  // the model lacks 0.6 of "wave": the scan lies where it would bring it
  const ScoreTable table = score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1);
  const Score& best = table.scores.front();
  EXPECT_EQ(best.effect, "wave");
  EXPECT_NEAR(best.step[0], 0.6, 4 * best.step_sd[0]);
  EXPECT_LT(best.step_sd[0], 0.05);
  EXPECT_LT(best.p_value, 0.002);
  EXPECT_NEAR(best.predicted_rms_mm, 0.5, 0.03);
  EXPECT_LT(best.predicted_held_out_rms_mm, 0.95 * table.base_held_out_rms_mm);
}

TEST(ScoreTest, AOneSidedEffectOfTheWrongSignScoresNothing) {
  Residuals r = sheet(3);
  const auto candidates = catalogue_of(r);
  r.distance_mm += 0.6 * candidates[2].slope;
  const ScoreTable table = score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1);
  const Score& ring = score_of(table, "ring");
  EXPECT_TRUE(ring.wrong_sign);
  EXPECT_EQ(ring.statistic, 0);
  EXPECT_LT(ring.step[0], 0);
  r.distance_mm -= 1.2 * candidates[2].slope;
  const ScoreTable right = score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1);
  EXPECT_EQ(right.scores.front().effect, "ring");
}

TEST(ScoreTest, WhatRecalibrationAbsorbsScoresNothing) {
  Residuals r = sheet(4);
  r.distance_mm += 3 * fitted_slopes(r).col(1);
  const ScoreTable before =
      score_candidates(sheet(4), no_mean(r), fitted_slopes(r), catalogue_of(r), Whitening::independent(r), 1);
  const ScoreTable after =
      score_candidates(r, no_mean(r), fitted_slopes(r), catalogue_of(r), Whitening::independent(r), 1);
  for (const Score& score : before.scores) EXPECT_NEAR(score.statistic, score_of(after, score.effect).statistic, 1e-7);
}

TEST(ScoreTest, FalseAlarmsComeAtTheirRate) {
  int alarms = 0;
  constexpr int trials = 200;
  for (int trial = 0; trial < trials; ++trial) {
    const Residuals r = sheet(100 + static_cast<unsigned>(trial), 200);
    const ScoreTable table =
        score_candidates(r, no_mean(r), fitted_slopes(r), catalogue_of(r), Whitening::independent(r), 1);
    alarms += table.scores.front().p_value < 0.05;
  }
  EXPECT_GE(alarms, 1);   // 10 expected, binomial sd 3.1
  EXPECT_LE(alarms, 22);  // four of them above
}

TEST(ScoreTest, SameDirectionIsNotToldApart) {
  const Residuals r = sheet(5);
  auto candidates = catalogue_of(r);
  candidates.push_back(candidate("twin", candidates[0].slope + 0.1 * candidates[1].slope.col(0)));
  const ScoreTable table = score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1);
  EXPECT_EQ(score_of(table, "wave").not_told_apart_from, std::vector<std::string>{"twin"});
  EXPECT_TRUE(score_of(table, "ring").not_told_apart_from.empty());
}

TEST(ScoreTest, AlikeIsTheCorrelationOfWhatRecalibrationLeaves) {
  const Residuals r = sheet(6);
  auto candidates = catalogue_of(r);
  candidates.push_back(candidate("tilted", candidates[0].slope + 5 * fitted_slopes(r).col(1)));
  const ScoreTable table = score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1);
  EXPECT_EQ(table.effects, (std::vector<std::string>{"wave", "pair", "ring", "tilted"}));
  EXPECT_NEAR(table.alike(0, 3), 1, 1e-9) << "all that tilted has beside the wave is absorbed";
  const Eigen::MatrixXd& s = fitted_slopes(r);
  const auto freed = [&s](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    return v - s * s.colPivHouseholderQr().solve(v);
  };
  const Eigen::VectorXd wave = freed(candidates[0].slope), ring = freed(candidates[2].slope);
  EXPECT_NEAR(table.alike(0, 2), std::abs(wave.normalized().dot(ring.normalized())), 1e-9);
  EXPECT_TRUE(table.alike.isApprox(table.alike.transpose()));
}

TEST(ScoreTest, PowerIsThatOfTheNoncentralChiSquared) {
  // Quantiles of 95 %, and λ with a power of 80 % (tables of the central and the noncentral χ²).
  constexpr struct {
    int freedom;
    double quantile, lambda;
  } rows[] = {{1, 3.8415, 7.849}, {2, 5.9915, 9.635}, {3, 7.8147, 10.903}, {6, 12.5916, 13.624}};
  for (const auto& [freedom, quantile, lambda] : rows) {
    EXPECT_NEAR(chi_squared_power(freedom, 0, quantile), 0.05, 1e-5) << freedom;
    EXPECT_NEAR(chi_squared_power(freedom, lambda, quantile), 0.8, 1e-3) << freedom;
  }
  EXPECT_EQ(chi_squared_power(1, 2e4, 10), 1);
}

TEST(ScoreTest, PowerIsTheShareOfScansThatScoreAboveChance) {
  // A wave as large as its secant (less than the slope at its null promises) in fresh noise.
  int found = 0;
  double power = 0;
  constexpr int trials = 200;
  for (int trial = 0; trial < trials; ++trial) {
    Residuals r = sheet(300 + static_cast<unsigned>(trial), 200);
    auto candidates = catalogue_of(r);
    const Eigen::VectorXd& wave = candidates[0].slope;
    candidates[0].secant = 3.6 * 0.5 / wave.norm() * wave;  // 0.5 mm of noise
    r.distance_mm += candidates[0].secant;
    const ScoreTable table =
        score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1);
    found += score_of(table, "wave").p_value < 0.05;
    power += score_of(table, "wave").power / trials;
  }
  EXPECT_GT(power, 0.5);
  EXPECT_LT(power, 0.95);
  EXPECT_NEAR(found / static_cast<double>(trials), power, 4 * std::sqrt(power * (1 - power) / trials));
}

TEST(ScoreTest, FactorToBeExpectedIsTheMeanOverScansThatHaveTheEffect) {
  // ln of the density of the score under a normal prior of the effect's size over that without it.
  Residuals r = sheet(5, 200);
  auto candidates = catalogue_of(r);
  const Eigen::VectorXd& wave = candidates[0].slope;
  candidates[0].secant = 2.5 * 0.5 / wave.norm() * wave;  // 0.5 mm of noise
  const ScoreTable table = score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1);
  const double lambda = score_of(table, "wave").noncentrality;
  EXPECT_GT(lambda, 2);
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal(std::sqrt(lambda), 1);
  double sum = 0;
  constexpr int draws = 200000;
  for (int k = 0; k < draws; ++k) {
    const double z = normal(generator), wide = 1 + lambda;
    sum += 0.5 * (z * z - z * z / wide - std::log(wide));
  }
  EXPECT_NEAR(score_of(table, "wave").expected_ln_factor, sum / draws, 0.02);
}

TEST(ScoreTest, SizeThatIsNamedIsNamedInTheShareOfScansThatItIsFor) {
  constexpr double ln_factor = 6.3, lambda = 4;
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  for (const int q : {1, 3})
    for (const double share : {0.5, 0.9}) {
      const double size = size_that_reaches(ln_factor, share, lambda, q), width = 1 + lambda / q;
      EXPECT_GT(size, 1);
      int named = 0;
      constexpr int draws = 40000;
      for (int k = 0; k < draws; ++k) {
        double square = 0;
        for (int i = 0; i < q; ++i) square += std::pow(normal(generator) + (i == 0 ? size * std::sqrt(lambda) : 0), 2);
        named += 0.5 * (square - square / width - q * std::log(width)) > ln_factor;
      }
      EXPECT_NEAR(named / static_cast<double>(draws), share, 0.012) << q;
    }
  EXPECT_EQ(size_that_reaches(ln_factor, 0.5, 0, 1), std::numeric_limits<double>::infinity());
}

TEST(ScoreTest, ChiSquaredTailsAreThoseOfTheTables) {
  EXPECT_NEAR(chi_squared_above(1, 3.841), 0.05, 1e-4);
  EXPECT_NEAR(chi_squared_above(10, 18.307), 0.05, 1e-4);
  EXPECT_NEAR(chi_squared_above(28, 48.278), 0.01, 1e-4);
  EXPECT_EQ(chi_squared_above(5, 0), 1);
}

TEST(ScoreTest, WhatTheMeshTakesAwayIsTestedAndPredictedErrorsAreThoseOfTheDistancesAsTheyAre) {
  const Residuals r = sheet(1);
  const auto candidates = catalogue_of(r);
  const Whitening whitening = Whitening::independent(r);
  const Eigen::VectorXd mean = -candidates[0].slope.col(0);
  Residuals moved = r;
  moved.distance_mm += mean;
  const ScoreTable table = score_candidates(r, mean, fitted_slopes(r), candidates, whitening, 1);
  const ScoreTable of_moved = score_candidates(moved, no_mean(r), fitted_slopes(r), candidates, whitening, 1);
  EXPECT_DOUBLE_EQ(score_of(table, "wave").statistic, score_of(of_moved, "wave").statistic);
  EXPECT_DOUBLE_EQ(score_of(table, "wave").step[0], score_of(of_moved, "wave").step[0]);
  const ScoreTable plain = score_candidates(r, no_mean(r), fitted_slopes(r), candidates, whitening, 1);
  EXPECT_DOUBLE_EQ(table.base_rms_mm, plain.base_rms_mm);
  // The step takes away what the mesh does, which the distances as they are do not have.
  EXPECT_GT(score_of(table, "wave").predicted_rms_mm, 1.05 * plain.base_rms_mm);
}

TEST(ScoreTest, OfTheWrongSignIsNotCalledImplausiblyLargeAsWell) {
  Residuals r = sheet(1);
  const auto candidates = catalogue_of(r);
  r.distance_mm += candidates[2].slope.col(0);  // as if there were less than none of it
  const Score ring =
      score_of(score_candidates(r, no_mean(r), fitted_slopes(r), candidates, Whitening::independent(r), 1), "ring");
  EXPECT_TRUE(ring.wrong_sign);
  EXPECT_FALSE(ring.beyond_range);
}

}  // namespace
}  // namespace supine::diagnosis
