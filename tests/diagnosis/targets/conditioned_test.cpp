// SPDX-License-Identifier: AGPL-3.0-or-later
// Conditioning of places on distances, against draws and against formulas of one unknown.
#include "diagnosis/targets/conditioned.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
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
    moves.sizes_mm = VectorXd::Constant(1, 0.7), moves.size_probability = VectorXd::Ones(1);
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
  both.sizes_mm = Eigen::Vector2d(0.7, 2), both.size_probability = Eigen::Vector2d(0.25, 0.75);
  const ConditionedTargets a = condition(one), b = condition(other), mixed = condition(both);
  const VectorXd mean = 0.25 * a.mean + 0.75 * b.mean;
  MatrixXd covariance = MatrixXd::Zero(6, 6);
  for (const auto& [weight, part] : {std::pair(0.25, &a), std::pair(0.75, &b)})
    covariance += weight * (part->covariance + (part->mean - mean) * (part->mean - mean).transpose());
  EXPECT_LT((mixed.mean - mean).norm(), 1e-12);
  EXPECT_LT((mixed.covariance - covariance).norm(), 1e-10);
}

TEST(SurpriseOfSomeDistances, HasTheDistributionItStates) {
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
    const Surprise surprise = surprise_of(made.moves, rows);
    beyond += surprise.p_value < 0.05;
    square += surprise.square / draws;
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
