// SPDX-License-Identifier: AGPL-3.0-or-later
// Conditioning of places on distances, against draws and against formulas of one unknown.
#include "diagnosis/targets/conditioned.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <limits>
#include <random>

#include "common/statistics.h"
#include "diagnosis/targets/further_scan.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd drawn(Index rows, Index cols, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  MatrixXd matrix(rows, cols);
  for (double& value : matrix.reshaped()) value = normal(generator);
  return matrix;
}

/// Unknowns with columns of everything: 4 directions, 3 patches, 5 forces, 7 distances, 6 numbers of places.
struct Made {
  JointMoves moves;
  MatrixXd data_forces, target_forces;

  explicit Made(unsigned seed) {
    std::mt19937 generator(seed);
    moves.mean = drawn(4, 1, generator), moves.sd = drawn(4, 1, generator).cwiseAbs().array() + 0.3;
    moves.data = drawn(7, 4, generator), moves.targets = drawn(6, 4, generator);
    moves.data_patches = drawn(7, 3, generator), moves.target_patches = drawn(6, 3, generator);
    data_forces = drawn(7, 5, generator), target_forces = drawn(6, 5, generator);
    moves.data_errors = 0.2 * MatrixXd::Identity(7, 7) + moves.data_patches * moves.data_patches.transpose();
    moves.data_kernel = data_forces * data_forces.transpose();
    moves.cross_kernel = target_forces * data_forces.transpose();
    moves.target_kernel = target_forces * target_forces.transpose();
    moves.target_errors = 0.1 * MatrixXd::Identity(6, 6);
    moves.y = drawn(7, 1, generator);
    moves.sizes_mm = VectorXd::Constant(1, 0.7), moves.sets = {{{0, 1, 2, 3}, VectorXd::Ones(1)}};
  }
};

/// Places by least squares in every unknown: the same posterior, by another way.
struct ByUnknowns {
  VectorXd mean;
  MatrixXd covariance;
};
ByUnknowns by_unknowns(const Made& made) {
  const JointMoves& m = made.moves;
  const double s = m.sizes_mm[0];
  MatrixXd all(7, 12), places(6, 12);
  all << m.data, m.data_patches, s * made.data_forces;
  places << m.targets, m.target_patches, s * made.target_forces;
  VectorXd prior = VectorXd::Zero(12), precision = VectorXd::Ones(12);
  prior.head(4) = m.mean, precision.head(4) = m.sd.cwiseAbs2().cwiseInverse();
  const MatrixXd information = all.transpose() * all / 0.2 + MatrixXd(precision.asDiagonal());
  const VectorXd mode = information.ldlt().solve(precision.cwiseProduct(prior) - all.transpose() * m.y / 0.2);
  return {places * mode,
          places * information.ldlt().solve(MatrixXd::Identity(12, 12)) * places.transpose() + m.target_errors};
}

TEST(ConditionedTargets, AreThePosteriorOfAllUnknowns) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Made made(seed);
    const ConditionedTargets found = condition(made.moves);
    const ByUnknowns wanted = by_unknowns(made);
    EXPECT_LT((found.mean - wanted.mean).norm(), 1e-9 * wanted.mean.norm());
    EXPECT_LT((found.covariance - wanted.covariance).norm(), 1e-9 * wanted.covariance.norm());
    EXPECT_LT((covariance_after(made.moves, 0.7) - wanted.covariance).norm(), 1e-9 * wanted.covariance.norm());
  }
}

TEST(ConditionedTargets, WithoutMeasurementsArePriors) {
  Made made(3);
  JointMoves& m = made.moves;
  m.data.resize(0, 4), m.y.resize(0), m.data_errors.resize(0, 0), m.data_patches.resize(0, 3);
  m.data_kernel.resize(0, 0), m.cross_kernel.resize(6, 0);
  const ConditionedTargets found = condition(m);
  EXPECT_LT((found.mean - m.targets * m.mean).norm(), 1e-12);
  EXPECT_LT((found.directions_covariance - MatrixXd(m.sd.cwiseAbs2().asDiagonal())).norm(), 1e-12);
}

TEST(ConditionedTargets, MixTheirSizes) {
  Made made(4);
  JointMoves one = made.moves, other = made.moves, both = made.moves;
  other.sizes_mm[0] = 2;
  both.sizes_mm = Eigen::Vector2d(0.7, 2), both.sets[0].size_probability = Eigen::Vector2d(0.25, 0.75);
  const ConditionedTargets a = condition(one), b = condition(other), mixed = condition(both);
  const VectorXd mean = 0.25 * a.mean + 0.75 * b.mean;
  MatrixXd covariance = MatrixXd::Zero(6, 6);
  for (const auto& [weight, part] : {std::pair(0.25, &a), std::pair(0.75, &b)})
    covariance += weight * (part->covariance + (part->mean - mean) * (part->mean - mean).transpose());
  EXPECT_LT((mixed.mean - mean).norm(), 1e-12);
  EXPECT_LT((mixed.covariance - covariance).norm(), 1e-10);
}

/// One direction more, that is there with some probability, and the evidence of both sets as its formula has it.
struct Mixed : Made {
  static constexpr double with_it = 0.3, size = 0.7;
  MatrixXd covariance_of(const std::vector<int>& set) const {
    const MatrixXd columns = moves.data(Eigen::all, set);
    return moves.data_errors + size * size * moves.data_kernel +
           columns * moves.sd(set).cwiseAbs2().asDiagonal() * columns.transpose();
  }
  double density(const std::vector<int>& set, const std::vector<int>& rows) const {
    const MatrixXd covariance = covariance_of(set)(rows, rows);
    const VectorXd off = (moves.y + moves.data(Eigen::all, set) * moves.mean(set))(rows);
    return std::exp(-0.5 * off.dot(covariance.ldlt().solve(off))) / std::sqrt(covariance.determinant());
  }
  /// Sets weighed by what @p rows of the distances say.
  void weigh(const std::vector<int>& rows) {
    const double less = (1 - with_it) * density({0, 1, 2}, rows), all = with_it * density({0, 1, 2, 3}, rows);
    moves.sets = {{{0, 1, 2}, VectorXd::Constant(1, less / (less + all))},
                  {{0, 1, 2, 3}, VectorXd::Constant(1, all / (less + all))}};
  }
  explicit Mixed(unsigned seed) : Made(seed) { weigh({0, 1, 2, 3, 4, 5, 6}); }
};

TEST(ConditionedTargets, MixTheirSets) {
  const Mixed made(7);
  JointMoves less = made.moves, all = made.moves;
  less.sets = {{{0, 1, 2}, VectorXd::Ones(1)}}, all.sets = {{{0, 1, 2, 3}, VectorXd::Ones(1)}};
  const ConditionedTargets a = condition(less), b = condition(all), mixed = condition(made.moves);
  const double p = made.moves.sets[1].size_probability[0];
  const VectorXd mean = (1 - p) * a.mean + p * b.mean;
  MatrixXd covariance = MatrixXd::Zero(6, 6), with = MatrixXd::Zero(6, 4);
  for (const auto& [weight, part] : {std::pair(1 - p, &a), std::pair(p, &b)}) {
    covariance += weight * (part->covariance + (part->mean - mean) * (part->mean - mean).transpose());
    with += weight * (part->with_directions + (part->mean - mean) * part->directions_mean.transpose());
  }
  EXPECT_LT((mixed.mean - mean).norm(), 1e-12);
  EXPECT_LT((mixed.covariance - covariance).norm(), 1e-10);
  EXPECT_LT((mixed.with_directions - with).norm(), 1e-10);
  EXPECT_EQ(a.directions_covariance(3, 3), 0) << "what is not there is known";
}

TEST(ConditionedTargets, HoldTheTruthAsOftenAsTheySay) {
  Mixed made(8);
  made.moves.targets.col(3) *= 6;  // what may be there moves the places far
  std::mt19937 generator(13);
  MatrixXd all(7, 12), places(6, 12);
  all << made.moves.data, made.moves.data_patches, Mixed::size * made.data_forces;
  places << made.moves.targets, made.moves.target_patches, Mixed::size * made.target_forces;
  constexpr int draws = 1000;
  int inside = 0, inside_if_nothing = 0;
  std::bernoulli_distribution there(Mixed::with_it);
  const auto holds = [](const ConditionedTargets& known, const VectorXd& t, double reach) {
    const Eigen::Vector3d off = t.head(3) - known.mean.head(3);
    return off.dot(known.covariance.topLeftCorner<3, 3>().ldlt().solve(off)) <= reach;
  };
  for (int d = 0; d < draws; ++d) {
    VectorXd unknowns = drawn(12, 1, generator);
    unknowns.head(4) = made.moves.mean + made.moves.sd.cwiseProduct(unknowns.head(4));
    if (!there(generator)) unknowns[3] = 0;
    made.moves.y = -(all * unknowns + std::sqrt(0.2) * drawn(7, 1, generator));
    const VectorXd t = places * unknowns + std::sqrt(0.1) * drawn(6, 1, generator);
    made.weigh({0, 1, 2, 3, 4, 5, 6});
    const ConditionedTargets known = condition(made.moves);
    inside += holds(known, t, known.reach95[0]);
    JointMoves nothing = made.moves;
    nothing.sets = {{{0, 1, 2}, VectorXd::Ones(1)}};
    inside_if_nothing += holds(condition(nothing), t, chi_squared_quantile(3, 0.95));
  }
  EXPECT_NEAR(inside, 0.95 * draws, 3 * std::sqrt(0.95 * 0.05 * draws) + 5);
  EXPECT_LT(inside_if_nothing, 0.88 * draws);
}

TEST(ConditionedTargets, CutWhatHasNoValuesBelow) {
  for (const int z_at : {0, 2, 3}) {
    Made made(9);
    JointMoves& m = made.moves;
    m.least = VectorXd::Constant(4, -std::numeric_limits<double>::infinity());
    const ConditionedTargets whole = condition(m);
    // Half a standard deviation above where it is: most of it is cut.
    const double sd = std::sqrt(whole.directions_covariance(z_at, z_at));
    const double least = whole.directions_mean[z_at] + 0.5 * sd;
    m.least[z_at] = least;
    const ConditionedTargets cut = condition(m);
    std::mt19937 generator(14);
    std::normal_distribution<double> normal;
    const VectorXd gain = whole.with_directions.col(z_at) / (sd * sd);
    VectorXd mean = VectorXd::Zero(6);
    double number = 0;
    constexpr int draws = 20000;
    for (int kept = 0; kept < draws;) {
      const double z = whole.directions_mean[z_at] + sd * normal(generator);
      if (z < least) continue;
      ++kept;
      number += z / draws, mean += (whole.mean + gain * (z - whole.directions_mean[z_at])) / draws;
    }
    EXPECT_NEAR(cut.directions_mean[z_at], number, 0.02 * sd) << z_at;
    EXPECT_LT((cut.mean - mean).norm(), 0.02 * sd * gain.norm()) << z_at;
    EXPECT_LT(cut.directions_covariance(z_at, z_at), 0.3 * sd * sd) << z_at;
    EXPECT_LT(cut.covariance.trace(), whole.covariance.trace()) << z_at;
  }
}

TEST(DistancesExpectedByOthers, CountSetsAsTheOthersHaveThem) {
  Mixed made(10);
  const std::vector<int> rows = {1, 4, 5}, others = {0, 2, 3, 6};
  const Expected found = expected_by_others(made.moves, rows);
  const auto of_set = [&](const std::vector<int>& set) {
    const MatrixXd all = made.covariance_of(set), gain = all(rows, others) * all(others, others).inverse();
    const VectorXd off = made.moves.y + made.moves.data(Eigen::all, set) * made.moves.mean(set);
    return std::pair<VectorXd, MatrixXd>(off(rows) - gain * off(others), all(rows, rows) - gain * all(others, rows));
  };
  made.weigh(others);
  const double p = made.moves.sets[1].size_probability[0];
  const auto [less_mean, less] = of_set({0, 1, 2});
  const auto [all_mean, all] = of_set({0, 1, 2, 3});
  const VectorXd mean = (1 - p) * less_mean + p * all_mean;
  const MatrixXd second =
      (1 - p) * (less + less_mean * less_mean.transpose()) + p * (all + all_mean * all_mean.transpose());
  EXPECT_LT((found.less_expected - mean).norm(), 1e-9);
  EXPECT_LT((found.covariance - (second - mean * mean.transpose())).norm(), 1e-9);
}

TEST(DistancesExpectedByOthers, HaveTheDistributionTheyState) {
  Made made(5);
  std::mt19937 generator(11);
  const JointMoves& m = made.moves;
  MatrixXd all(7, 12);
  all << m.data, m.data_patches, 0.7 * made.data_forces;
  const std::vector<int> rows = {1, 4, 5};
  int beyond = 0;
  constexpr int draws = 2000;
  double square = 0;
  for (int d = 0; d < draws; ++d) {
    VectorXd unknowns = drawn(12, 1, generator);
    unknowns.head(4) = m.mean + m.sd.cwiseProduct(unknowns.head(4));
    made.moves.y = -(all * unknowns + std::sqrt(0.2) * drawn(7, 1, generator));
    const Expected expected = expected_by_others(made.moves, rows);
    const double found = expected.less_expected.dot(expected.covariance.ldlt().solve(expected.less_expected));
    beyond += chi_squared_above(3, found) < 0.05;
    square += found / draws;
  }
  EXPECT_NEAR(beyond, 0.05 * draws, 3 * std::sqrt(0.05 * 0.95 * draws));
  EXPECT_NEAR(square, 3, 3 * std::sqrt(6.0 / draws));
}

TEST(FurtherScanRows, AreWhatMeasuringThemAsWellWouldLeave) {
  Made made(6);
  std::mt19937 generator(12);
  // Three more rows with two nuisances of their own; the forces of their pose are half those of the other.
  FurtherScan scan;
  scan.directions = drawn(3, 6, generator), scan.patches = drawn(3, 3, generator), scan.forces = drawn(3, 5, generator);
  scan.errors = 0.3 * MatrixXd::Identity(3, 3);
  scan.kernel = scan.forces * scan.forces.transpose();
  const JointMoves more = with_further_scan(made.moves, scan, made.data_forces, made.target_forces);
  const MatrixXd found = covariance_after(more, 0.7);
  // Unknowns: 6 directions, 3 patches, then common forces and each pose's own, half the variance each.
  const double s = 0.7, half = std::sqrt(0.5);
  MatrixXd all = MatrixXd::Zero(10, 24), places = MatrixXd::Zero(6, 24);
  all.topLeftCorner(7, 4) = made.moves.data, all.bottomLeftCorner(3, 6) = scan.directions;
  all.block(0, 6, 7, 3) = made.moves.data_patches, all.block(7, 6, 3, 3) = scan.patches;
  all.block(0, 9, 7, 5) = s * half * made.data_forces, all.block(7, 9, 3, 5) = s * half * scan.forces;
  all.block(0, 14, 7, 5) = s * half * made.data_forces, all.block(7, 19, 3, 5) = s * half * scan.forces;
  places.leftCols(4) = made.moves.targets, places.middleCols(6, 3) = made.moves.target_patches;
  places.middleCols(9, 5) = s * half * made.target_forces, places.middleCols(14, 5) = s * half * made.target_forces;
  VectorXd precision = VectorXd::Ones(24), noise = VectorXd::Constant(10, 1 / 0.2);
  precision.head(4) = made.moves.sd.cwiseAbs2().cwiseInverse(), noise.tail(3).setConstant(1 / 0.3);
  const MatrixXd information = all.transpose() * noise.asDiagonal() * all + MatrixXd(precision.asDiagonal());
  const MatrixXd wanted =
      places * information.ldlt().solve(MatrixXd::Identity(24, 24)) * places.transpose() + made.moves.target_errors;
  EXPECT_LT((found - wanted).norm(), 1e-9 * wanted.norm());
  EXPECT_LT(found.trace(), covariance_after(made.moves, 0.7).trace()) << "more is known";
}

}  // namespace
}  // namespace supine::diagnosis
