// SPDX-License-Identifier: AGPL-3.0-or-later
// Steps inside a box, the trust region, runs that are given up, and moduli that no tissue has.
#include "calibration/bounded_descent.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

#include "calibration/tissue_range.h"
#include "tests/calibration/twin.h"

namespace supine::calibration {
namespace {

using supine::testing::Twin;
using supine::testing::twin_start;
using supine::testing::twin_truth;

double model_of(const Eigen::MatrixXd& a, const Eigen::VectorXd& g, const Eigen::VectorXd& s) {
  return g.dot(s) + 0.5 * s.dot(a * s);
}

/// The least over every way of putting coordinates on an end or leaving them free.
double least_by_trying_all(const Eigen::MatrixXd& a, const Eigen::VectorXd& g, const Eigen::VectorXd& lower,
                           const Eigen::VectorXd& upper) {
  const auto n = static_cast<int>(g.size());
  double least = std::numeric_limits<double>::infinity();
  for (int way = 0; way < std::pow(3, n); ++way) {
    Eigen::VectorXd s = Eigen::VectorXd::Zero(n);
    std::vector<int> free;
    for (int i = 0, rest = way; i < n; ++i, rest /= 3) {
      if (rest % 3 == 0) free.push_back(i);
      if (rest % 3 == 1) s[i] = lower[i];
      if (rest % 3 == 2) s[i] = upper[i];
    }
    if (!free.empty()) {
      const Eigen::VectorXd gradient = g + a * s;
      const Eigen::VectorXd part = -a(free, free).ldlt().solve(gradient(free));
      for (std::size_t k = 0; k < free.size(); ++k) s[free[k]] = part[static_cast<Eigen::Index>(k)];
    }
    if (((s - lower).array() < -1e-12).any() || ((upper - s).array() < -1e-12).any()) continue;
    least = std::min(least, model_of(a, g, s));
  }
  return least;
}

TEST(BoxStep, IsTheLeastInsideTheBox) {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + trial % 5;
    const auto draw = [&](auto matrix) { return matrix.unaryExpr([&](double) { return normal(generator); }).eval(); };
    const Eigen::MatrixXd root = draw(Eigen::MatrixXd::Zero(n + 2, n));
    const Eigen::MatrixXd a = root.transpose() * root;
    const Eigen::VectorXd g = 3 * draw(Eigen::VectorXd::Zero(n));
    const Eigen::VectorXd lower = -draw(Eigen::VectorXd::Zero(n)).cwiseAbs();
    const Eigen::VectorXd upper = draw(Eigen::VectorXd::Zero(n)).cwiseAbs();
    const Eigen::VectorXd s = box_step(a, g, lower, upper);
    ASSERT_TRUE(((s - lower).array() >= 0).all() && ((upper - s).array() >= 0).all()) << "trial " << trial;
    EXPECT_NEAR(model_of(a, g, s), least_by_trying_all(a, g, lower, upper), 1e-8) << "trial " << trial;
  }
}

TEST(BoxStep, HeldAndPushedOutCoordinatesStay) {
  const Eigen::Matrix2d a = (Eigen::Matrix2d() << 2, 1, 1, 2).finished();
  const Eigen::Vector2d held = box_step(a, Eigen::Vector2d(-4, -1), Eigen::Vector2d(-9, 0), Eigen::Vector2d(9, 0));
  EXPECT_NEAR(held[0], 2, 1e-9);
  EXPECT_EQ(held[1], 0);
  const Eigen::Vector2d out = box_step(a, Eigen::Vector2d(5, 0), Eigen::Vector2d(0, 0), Eigen::Vector2d(9, 9));
  EXPECT_EQ(out, Eigen::Vector2d(0, 0));
}

struct Trial {
  Twin twin{{twin_truth()}};
  simulation::Model start = twin_start();

  Fit fit(FitOptions options = {}) {
    const FreeParameters parameters(start);
    Evaluator evaluator(twin.scene(), start);
    options.noise_mm = {0.7};
    return fit_least_squares(evaluator, parameters, options);
  }
};

TEST(TrustRegion, AModulusGoesByAFactorOfFourAndAHalfAtMost) {
  Trial trial;
  trial.start.breast.young_modulus_kpa.value = 9;
  trial.start.skin.young_modulus_kpa.value = 290;
  const Fit fit = trial.fit();
  EXPECT_TRUE(fit.converged) << fit.message;
  EXPECT_NEAR(std::exp(fit.u[0]), 0.9, 2e-3);
  Eigen::VectorXd from = fit.history.front().values;
  for (const FitEvaluation& row : fit.history) {
    EXPECT_LT((row.values.array() / from.array()).log().abs().maxCoeff(), 1.5 + 1e-9);
    if (row.accepted) from = row.values;
  }
}

/// A fit by a solver of little patience, from the shape that a patient one has found.
Fit impatient_fit(Trial& trial, int max_iterations) {
  trial.start.breast.young_modulus_kpa = {3, true, {}, 0.1, 10};
  const auto near =
      simulation::solve_chain(trial.twin.mesh, trial.twin.anatomy, trial.start, {trial.twin.prone, trial.twin.supine});
  const FreeParameters parameters(trial.start);
  Evaluator evaluator(
      trial.twin.scene(), trial.start,
      {.max_iterations = max_iterations, .residual_tolerance = 1e-6, .smallest_load_step = 1, .progress = {}});
  FitOptions options;
  options.noise_mm = {0.7};
  options.near = &near;
  return fit_least_squares(evaluator, parameters, options);
}

TEST(TrustRegion, TakesShorterStepsAfterOnesThatLeadNowhere) {
  Trial trial;
  const Fit fit = impatient_fit(trial, 1);
  EXPECT_TRUE(fit.converged) << fit.message;
  EXPECT_GT(fit.failed, 0);
  EXPECT_NEAR(std::exp(fit.u[0]), 0.9, 5e-3);
}

TEST(TrustRegion, EndsSoonWhereNoEquilibriumIsFoundAndSaysWhere) {
  Trial trial;
  const Fit fit = impatient_fit(trial, 0);
  EXPECT_FALSE(fit.converged);
  EXPECT_NE(fit.message.find("the error falls toward breast.young_modulus_kpa = 2."), std::string::npos) << fit.message;
  EXPECT_NE(fit.message.find("no equilibrium"), std::string::npos) << fit.message;
  EXPECT_LE(fit.evaluations, 8);
  EXPECT_EQ(fit.u, FreeParameters(trial.start).start());
}

TEST(TissueRange, NamesTheModuliThatNoTissueHas) {
  simulation::Model model = twin_start();
  const auto outside = [&model](double breast, double skin) {
    const FreeParameters parameters(model);
    return outside_tissue(parameters, Eigen::Vector2d(std::log(breast), std::log(skin)));
  };
  EXPECT_TRUE(outside(0.5, 20).empty());
  EXPECT_EQ(outside(0.19, 110), std::vector<Eigen::Index>{0});
  EXPECT_EQ(outside(0.5, 600), std::vector<Eigen::Index>{1});
  EXPECT_EQ(outside(30, 1).size(), 2u);
  EXPECT_FALSE(tissue_range("breast.poisson_ratio"));
}

}  // namespace
}  // namespace supine::calibration
