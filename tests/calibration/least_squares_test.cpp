// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/least_squares.h"

#include <gtest/gtest.h>

#include <cmath>

#include "calibration/uncertainty.h"
#include "common/error.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"
#include "tests/support/taylor.h"

namespace supine::calibration {
namespace {

using supine::testing::taylor_order;
using supine::testing::Twin;
using supine::testing::twin_start;
using supine::testing::twin_truth;

const Twin& exact_twin() {
  static const Twin twin({twin_truth()});
  return twin;
}

Eigen::VectorXd fitted_values(const Twin& twin, const simulation::Model& start, FitOptions options = {}) {
  const FreeParameters parameters(start);
  Evaluator evaluator(twin.scene(), start);
  options.noise_mm = {0.7};
  const Fit fit = fit_least_squares(evaluator, parameters, options);
  EXPECT_TRUE(fit.converged) << fit.message;
  return parameters.values(fit.u);
}

TEST(LeastSquares, RobustResidualIsSmoothAndItsSlopeIsItsDerivative) {
  for (const double d : {-20.0, -3.0, -0.1, 0.0, 0.5, 4.0, 60.0}) {
    const auto along = [d](double h) { return robust_residual(d + h, 5); };
    EXPECT_GT(taylor_order(along, robust_slope(d, 5), 0.02), d == 0.0 ? 2.5 : 1.85) << d;
  }
  EXPECT_NEAR(robust_residual(1e-3, 5), 1e-3, 1e-9);                   // small ones count fully,
  EXPECT_NEAR(std::pow(robust_residual(1e4, 5), 2) / 2, 5 * 1e4, 30);  // large ones linearly: ½g² → δ|d| − δ²
}

TEST(LeastSquares, FindsTheNumbersTheScanWasMadeWith) {
  const Eigen::VectorXd values = fitted_values(exact_twin(), twin_start());
  EXPECT_NEAR(values[0], 0.9, 1e-3);
  EXPECT_NEAR(values[1], 25, 0.1);
}

TEST(LeastSquares, AFewRunsAreEnough) {
  const FreeParameters parameters(twin_start());
  Evaluator evaluator(exact_twin().scene(), twin_start());
  FitOptions options;
  options.noise_mm = {0.7};
  const Fit fit = fit_least_squares(evaluator, parameters, options);
  EXPECT_LE(fit.evaluations, 12);
  EXPECT_EQ(fit.history.size(), static_cast<std::size_t>(fit.evaluations));
  EXPECT_EQ(fit.failed, 0);
}

TEST(LeastSquares, SlopesAreTheDerivativesOfTheDistancesThroughBothSolves) {
  simulation::Model model = twin_start();
  simulation::EffectSetting effect = simulation::null_setting(*simulation::find_effect("misregistration"));
  effect.parameters["shift_x_mm"] = {1.5, true, 3.0, -25, 25};
  effect.parameters["turn_z_rad"] = {0.03, true, 0.05, -0.3, 0.3};
  model.effects = {effect};
  const FreeParameters parameters(model);
  ASSERT_EQ(parameters.size(), 4);
  Evaluator evaluator(exact_twin().scene(), model);
  FitOptions options;
  options.noise_mm = {0.7};
  const Fit fit = evaluate_fit(evaluator, parameters, options, parameters.start());
  for (Eigen::Index j = 0; j < parameters.size(); ++j) {
    ASSERT_GT(fit.linearisation.slope.col(j).norm(), 1e-3) << parameters.names()[static_cast<std::size_t>(j)];
    // Half the squared distances: its derivative exists where a closest point moves on to the next triangle.
    const auto misfit = [&](double h) {
      Eigen::VectorXd u = fit.u;
      u[j] += h;
      const Prediction p = evaluator.predict(parameters.model(u), &fit.prediction.solution);
      return 0.5 * residuals_of(evaluator.scene(), p, fit.mask, {0.7}).distance_mm.squaredNorm();
    };
    const double slope = fit.linearisation.slope.col(j).dot(fit.residuals.distance_mm);
    EXPECT_GT(taylor_order(misfit, slope, 2e-2, 4), 1.8) << parameters.names()[static_cast<std::size_t>(j)];
  }
}

TEST(LeastSquares, DoesNotDependOnTheOrderOfThePoints) {
  Twin::Options options{twin_truth(), 0.7};
  const Eigen::VectorXd forward = fitted_values(Twin(options), twin_start());
  options.reversed = true;
  const Eigen::VectorXd backward = fitted_values(Twin(options), twin_start());
  EXPECT_LT((forward - backward).cwiseQuotient(forward).norm(), 1e-6);
}

TEST(LeastSquares, DoesNotDependOnTheFrame) {
  Twin::Options options{twin_truth(), 0.7};
  const Eigen::VectorXd here = fitted_values(Twin(options), twin_start());
  options.frame = Eigen::Translation3d(30, -200, 80) * Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized());
  const Eigen::VectorXd there = fitted_values(Twin(options), twin_start());
  // The anatomy's fits are iterative; the fitted numbers follow them.
  EXPECT_LT((here - there).cwiseQuotient(here).norm(), 1e-3);
}

TEST(LeastSquares, AHoleLeavesTheAnswerWhereItIs) {
  Twin::Options options{twin_truth()};
  options.left_out_from_x = 15;
  const Twin twin(options);
  EXPECT_LT(twin.measurement->scan.points().rows(), 0.8 * exact_twin().measurement->scan.points().rows());
  const Eigen::VectorXd values = fitted_values(twin, twin_start());
  EXPECT_NEAR(values[0], 0.9, 2e-3);
  EXPECT_NEAR(values[1], 25, 0.2);
}

TEST(LeastSquares, AStrongPriorHoldsItsParameter) {
  simulation::Model start = twin_start();
  start.skin.young_modulus_kpa.prior_sd = 1e-3;
  EXPECT_NEAR(fitted_values(exact_twin(), start)[1], 40, 0.1);
  FitOptions without;
  without.use_priors = false;
  EXPECT_NEAR(fitted_values(exact_twin(), start, without)[1], 25, 0.1);
}

TEST(LeastSquares, AtABoundTheOtherIsFittedAsIfTheFirstWereFixed) {
  simulation::Model start = twin_start();
  start.breast.young_modulus_kpa = {2.0, true, {}, 1.1, 10};
  const FreeParameters parameters(start);
  Evaluator evaluator(exact_twin().scene(), start);
  FitOptions options;
  options.noise_mm = {0.7};
  const Fit fit = fit_least_squares(evaluator, parameters, options);
  EXPECT_TRUE(fit.converged) << fit.message;
  EXPECT_EQ(fit.u[0], parameters.lower()[0]);
  EXPECT_LE(fit.evaluations, 12);
  start.breast.young_modulus_kpa = {1.1, false, {}, 0.1, 10};
  // Each descent ends within a twentieth of a standard deviation of what it looks for.
  const double sd = 0.7 / fit.linearisation.slope.col(1).norm();
  EXPECT_LT(sd, 0.2);
  EXPECT_NEAR(fit.u[1], std::log(fitted_values(exact_twin(), start)[0]), 0.1 * sd);
}

TEST(LeastSquares, ABoundLetsGoOnceTheOthersHaveSettled) {
  // Under a skin that is much too stiff the breast wants to be softer than its range allows, at the answer it does not.
  simulation::Model start = twin_start();
  start.breast.young_modulus_kpa = {0.85, true, {}, 0.85, 10};
  start.skin.young_modulus_kpa.value = 150;
  {
    const FreeParameters parameters(start);
    Evaluator evaluator(exact_twin().scene(), start);
    FitOptions options;
    options.noise_mm = {0.7};
    const Fit fit = evaluate_fit(evaluator, parameters, options, parameters.start());
    ASSERT_GT(fit.linearisation.slope.col(0).dot(fit.residuals.distance_mm), 0);
  }
  const Eigen::VectorXd values = fitted_values(exact_twin(), start);
  EXPECT_NEAR(values[0], 0.9, 1e-3);
  EXPECT_NEAR(values[1], 25, 0.1);
}

TEST(LeastSquares, EveryParameterAtItsBoundIsAnAnswerToo) {
  simulation::Model start = twin_start();
  start.breast.young_modulus_kpa = {1.5, true, {}, 1.2, 10};
  start.skin.young_modulus_kpa = {60, true, {}, 50, 300};
  const Eigen::VectorXd values = fitted_values(exact_twin(), start);
  EXPECT_DOUBLE_EQ(values[0], 1.2);
  EXPECT_DOUBLE_EQ(values[1], 50);
}

TEST(LeastSquares, RefusesARefitWithNothingToFit) {
  const FreeParameters parameters(twin_start());
  Evaluator evaluator(exact_twin().scene(), twin_start());
  FitOptions options;
  options.noise_mm = {0.7};
  const Fit fit = evaluate_fit(evaluator, parameters, options, parameters.start());
  try {
    refit(evaluator, parameters, options, fit, fit.u, {true, true});
    FAIL() << "both parameters are held";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "every parameter is held: nothing to fit");
  }
}

TEST(LeastSquares, RefusesOptionsThatMeanNothing) {
  const FreeParameters parameters(twin_start());
  Evaluator evaluator(exact_twin().scene(), twin_start());
  FitOptions options;
  EXPECT_THROW(fit_least_squares(evaluator, parameters, options), InputError);  // no noise
  options.noise_mm = {0.0};
  EXPECT_THROW(fit_least_squares(evaluator, parameters, options), InputError);
  options.noise_mm = {0.7};
  options.robust_mm = 0;
  EXPECT_THROW(fit_least_squares(evaluator, parameters, options), InputError);
  options.robust_mm = 5;
  options.starts = 0;
  EXPECT_THROW(fit_least_squares(evaluator, parameters, options), InputError);
}

TEST(LeastSquares, SaysWhenNoStartHasAnEquilibrium) {
  simulation::Model soft = twin_start();
  soft.breast.young_modulus_kpa = {1e-3, true, {}, 1e-3, 2e-3};
  soft.skin.young_modulus_kpa = {1e-3, true, {}, 1e-3, 2e-3};
  const FreeParameters parameters(soft);
  // The first trial is enough to see that it fails.
  Evaluator evaluator(exact_twin().scene(), soft, {.max_iterations = 5, .smallest_load_step = 0.5, .progress = {}});
  FitOptions options;
  options.noise_mm = {0.7};
  EXPECT_THROW(fit_least_squares(evaluator, parameters, options), NumericalFailure);
}

TEST(LeastSquares, SaysThatNoPointOfTheScanLiesOverTheSkin) {
  const Twin beside({.truth = twin_truth(), .frame = Eigen::Isometry3d(Eigen::Translation3d(500, 0, 0))});
  calibration::MeasuredScene scene = exact_twin().scene();
  scene.measurements = beside.scene().measurements;
  const FreeParameters parameters(twin_start());
  Evaluator evaluator(scene, twin_start());
  FitOptions options;
  options.noise_mm = {0.7};
  try {
    fit_least_squares(evaluator, parameters, options);
    FAIL() << "fitted";
  } catch (const NumericalFailure& error) {
    EXPECT_NE(std::string(error.what()).find("no point of a scan lies over the skin"), std::string::npos)
        << error.what();
  }
}

/// How far a node of the first pose is from where it was seen along y, over sigma.
class SeenHeight : public OwnResidual {
 public:
  SeenHeight(Eigen::Index node, double y_mm, double sigma_mm) : node_(node), y_mm_(y_mm), sigma_mm_(sigma_mm) {}
  std::string name() const override { return "seen height"; }
  Eigen::VectorXd value(const simulation::ChainSolution& shapes) const override {
    const Eigen::Index rows = ++calls_ > rows_change_at_ ? 2 : 1;
    return Eigen::VectorXd::Constant(rows, (shapes.poses[0].x(node_, 1) - y_mm_) / sigma_mm_);
  }
  Eigen::VectorXd change(const simulation::ChainSolution&, const simulation::ChainDerivative& move) const override {
    return Eigen::VectorXd::Constant(1, move.poses[0](node_, 1) / sigma_mm_);
  }
  int rows_change_at_ = 1000;

 private:
  Eigen::Index node_;
  double y_mm_, sigma_mm_;
  mutable int calls_ = 0;
};

Fit fit_with(const OwnResidual* own) {
  const FreeParameters parameters(twin_start());
  Evaluator evaluator(exact_twin().scene(), twin_start());
  FitOptions options;
  options.noise_mm = {0.7};
  if (own != nullptr) options.own = {own};
  return fit_least_squares(evaluator, parameters, options);
}

TEST(LeastSquares, AResidualOfOnesOwnCountsAsItsSigmaSays) {
  const Fit plain = fit_with(nullptr);
  const simulation::ChainSolution& shapes = plain.prediction.solution;
  Eigen::Index node = 0;
  (shapes.poses[0].x - shapes.prone).rowwise().norm().maxCoeff(&node);
  const double y = shapes.poses[0].x(node, 1);
  const SeenHeight loose(node, y + 1, 1e6), tight(node, y + 1, 0.001);
  EXPECT_LT((fit_with(&loose).u - plain.u).norm(), 1e-3);
  const Fit pulled = fit_with(&tight);
  EXPECT_NEAR(pulled.prediction.solution.poses[0].x(node, 1), y + 1, 0.2);
  // What it says of the parameters goes into their covariance.
  const FreeParameters parameters(twin_start());
  EXPECT_EQ(plain.own_information.size(), 0);
  Fit without = pulled;
  without.own_information.resize(0, 0);
  EXPECT_LT(judge(pulled, parameters, true).covariance.determinant(),
            0.5 * judge(without, parameters, true).covariance.determinant());
}

TEST(LeastSquares, AResidualWhoseRowsChangeInNumberIsRefused) {
  SeenHeight wrong(0, 0, 1);
  wrong.rows_change_at_ = 1;
  EXPECT_THROW(fit_with(&wrong), InputError);
}

}  // namespace
}  // namespace supine::calibration
