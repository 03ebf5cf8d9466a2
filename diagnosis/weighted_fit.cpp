// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/weighted_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "calibration/work_limit.h"
#include "common/error.h"

namespace supine::diagnosis {
namespace {

using calibration::Evaluator;
using calibration::FreeParameters;

/// A coordinate is at an end of its range when it is nearer than this; coordinates are of the order of 1.
constexpr double at_the_end = 1e-9;
/// Part of the largest curvature that is added to all: two causes that change the same distances leave none.
constexpr double least_curvature = 1e-9;
/// Longest step of a coordinate: a factor of 4.5 in a modulus, further than slopes are worth anything.
constexpr double longest_step = 1.5;

/// Marquardt's damping, in parts of each curvature.
struct Damping {
  static constexpr double first = 1e-3;               ///< exact sensitivities: almost Gauss-Newton
  static constexpr double after_failure = 10;         ///< grows by it where a step gains nothing or has no equilibrium,
  static constexpr double least_after_failure = 0.1;  ///< and is felt at once
  static constexpr double given_up = 1e4;             ///< steps of a ten-thousandth gain nothing either
  static constexpr double well_promised = 0.5;        ///< part of the promised gain above which slopes are trusted more
};

/// Whitened distances and their slopes, priors as further rows.
struct Rows {
  Eigen::VectorXd value;
  Eigen::MatrixXd slope;
};

Rows rows_of(const calibration::Fit& fit, const FreeParameters& parameters, const Metric& metric) {
  Eigen::MatrixXd columns(fit.residuals.size(), 1 + fit.linearisation.slope.cols());
  columns << fit.residuals.distance_mm + metric.mean_mm, fit.linearisation.slope;
  const Eigen::MatrixXd white = metric.whitening->apply(columns);
  const Eigen::Index n = white.rows(), p = parameters.size();
  Rows rows{Eigen::VectorXd(n + p), Eigen::MatrixXd::Zero(n + p, p)};
  rows.value << white.col(0), parameters.prior_deviation(fit.u);
  rows.slope.topRows(n) = white.rightCols(p);
  rows.slope.bottomRows(p).diagonal() = parameters.prior_information().cwiseSqrt();
  return rows;
}

/// F of a prediction, its slopes not needed.
void evaluate(const FreeParameters& parameters, const Metric& metric, WeightedFit& result) {
  const calibration::Fit& fit = result.solution;
  result.data = metric.whitening->apply(fit.residuals.distance_mm + metric.mean_mm).squaredNorm();
  result.objective = result.data + parameters.prior_deviation(fit.u).squaredNorm();
}

/// F at given coordinates, without its slopes.
WeightedFit predicted(Evaluator& evaluator, const FreeParameters& parameters, const Metric& metric,
                      const Eigen::VectorXd& u, const simulation::ChainSolution* near) {
  WeightedFit result;
  calibration::Fit& fit = result.solution;
  fit.u = u;
  fit.mask = metric.mask;
  fit.prediction = evaluator.predict(parameters.model(u), near);
  fit.residuals = calibration::residuals_of(evaluator.scene(), fit.prediction, fit.mask, metric.noise_mm);
  evaluate(parameters, metric, result);
  return result;
}

void add_slopes(Evaluator& evaluator, const FreeParameters& parameters, WeightedFit& result) {
  calibration::Fit& fit = result.solution;
  const simulation::Sensitivities sensitivities(evaluator.chain(), parameters.model(fit.u), fit.prediction.solution);
  fit.linearisation =
      calibration::linearise(evaluator, sensitivities, parameters, fit.u, fit.prediction, fit.residuals);
}

/// Coordinates that may move: not those at an end of their range that pull further out.
std::vector<int> movable(const FreeParameters& parameters, const Eigen::VectorXd& u, const Eigen::VectorXd& gradient) {
  std::vector<int> free;
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const bool low = u[i] <= parameters.lower()[i] + at_the_end && gradient[i] > 0;
    const bool high = u[i] >= parameters.upper()[i] - at_the_end && gradient[i] < 0;
    if (!low && !high) free.push_back(static_cast<int>(i));
  }
  return free;
}

/// The damped step, cut at the range.
Eigen::VectorXd step_of(const FreeParameters& parameters, const Rows& rows, const Eigen::VectorXd& u, double damping) {
  const Eigen::VectorXd gradient = rows.slope.transpose() * rows.value;
  const std::vector<int> free = movable(parameters, u, gradient);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(u.size());
  if (free.empty()) return step;
  const Eigen::MatrixXd j = rows.slope(Eigen::all, free);
  Eigen::MatrixXd h = j.transpose() * j;
  h.diagonal() *= 1 + damping;
  h.diagonal().array() += least_curvature * h.diagonal().maxCoeff();
  const Eigen::VectorXd part = -h.ldlt().solve(gradient(free));
  const double cut = std::min(1.0, longest_step / std::max(part.cwiseAbs().maxCoeff(), 1e-300));
  for (std::size_t k = 0; k < free.size(); ++k) step[free[k]] = cut * part[static_cast<Eigen::Index>(k)];
  return parameters.clamped(u + step) - u;
}

}  // namespace

simulation::SolveOptions accurate_enough() {
  simulation::SolveOptions options;
  options.step_tolerance_mm = 1e-5;
  options.residual_tolerance = 1e-8;
  return options;
}

simulation::SolveOptions accurate_enough_far_away() {
  simulation::SolveOptions options;
  options.step_tolerance_mm = 1e-3;
  options.residual_tolerance = 1e-6;
  return options;
}

WeightedFit weigh(Evaluator& evaluator, const FreeParameters& parameters, const Metric& metric,
                  const Eigen::VectorXd& u, const simulation::ChainSolution* near) {
  WeightedFit result = predicted(evaluator, parameters, metric, u, near);
  add_slopes(evaluator, parameters, result);
  result.evaluations = 1;
  return result;
}

void descend(Evaluator& evaluator, const FreeParameters& parameters, const Metric& metric,
             const DescentOptions& options, WeightedFit& fit) {
  double damping = Damping::first;
  int dearest = 0;
  fit.converged = false;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    const Rows rows = rows_of(fit.solution, parameters, metric);
    const Eigen::VectorXd step = step_of(parameters, rows, fit.solution.u, damping);
    const double promised = fit.objective - (rows.value + rows.slope * step).squaredNorm();
    if (promised < options.settled) {
      fit.converged = true;
      return;
    }
    const simulation::ChainSolution near =
        calibration::extrapolated(fit.solution.prediction.solution, fit.solution.linearisation.by_coordinate, step);
    ++fit.evaluations;
    dearest = std::max(dearest, fit.solution.prediction.solution.dearest_solve);
    try {
      const calibration::TrialLimit limit(evaluator.chain(), dearest);
      WeightedFit trial = predicted(evaluator, parameters, metric, fit.solution.u + step, &near);
      if (trial.objective < fit.objective) {
        add_slopes(evaluator, parameters, trial);
        const double kept = (fit.objective - trial.objective) / promised;
        trial.evaluations = fit.evaluations;
        fit = std::move(trial);
        damping = kept > Damping::well_promised ? damping / 5 : damping * 2;
        continue;
      }
    } catch (const NumericalFailure&) {
      // No equilibrium there, or none that costs as little: a shorter step.
    }
    if (promised < worth_shortening) return;
    damping = std::max(Damping::after_failure * damping, Damping::least_after_failure);
    if (damping > Damping::given_up) return;
  }
}

}  // namespace supine::diagnosis
