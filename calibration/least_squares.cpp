// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/least_squares.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <random>

#include "calibration/bounded_descent.h"
#include "common/error.h"

namespace supine::calibration {
namespace {

constexpr int most_mask_changes = 3;
constexpr double mask_share = 0.01;           // of the points may change sides after a descent
constexpr double spread_without_prior = 0.7;  // of further starts, in coordinates: a factor of two in a modulus

bool alike(const PointMask& a, const PointMask& b) {
  Eigen::Index changed = 0, all = 0;
  for (std::size_t m = 0; m < a.size(); ++m) {
    changed += (a[m] != b[m]).count();
    all += b[m].count();
  }
  return static_cast<double>(changed) <= mask_share * static_cast<double>(all);
}

/// One descent from coordinates u, its points chosen anew until they stay.
void search(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, int start,
            const Eigen::VectorXd& u, const simulation::ChainSolution* near, Fit& fit) {
  fit.u = u;
  ++fit.evaluations;
  fit.prediction = evaluator.predict(parameters.model(u), near);
  for (int pass = 0; pass < most_mask_changes; ++pass) {
    const PointMask mask = points_over_skin(fit.prediction);
    if (pass > 0 && alike(mask, fit.mask)) return;
    fit.mask = mask;
    descend(evaluator, parameters, options, start, {}, pass > 0 ? &fit.linearisation : nullptr, false, fit);
    if (!fit.converged) return;  // where this found no way, other points would find none either
  }
}

Eigen::VectorXd drawn_start(const FreeParameters& parameters, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd u = parameters.start();
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const auto& prior = parameters.priors()[static_cast<std::size_t>(i)];
    u[i] += normal(generator) * (prior ? prior->sd : spread_without_prior);
  }
  return parameters.clamped(u);
}

}  // namespace

void FitOptions::check(const MeasuredScene& scene) const {
  if (!(robust_mm > 0)) throw InputError(fmt::format("robust_mm = {}: must be > 0", robust_mm));
  if (max_iterations < 1) throw InputError(fmt::format("max_iterations = {}: must be > 0", max_iterations));
  if (starts < 1) throw InputError(fmt::format("starts = {}: must be > 0", starts));
  if (noise_mm.size() != scene.measurements.size())
    throw InputError(fmt::format("{} noise levels for {} measurements", noise_mm.size(), scene.measurements.size()));
  for (const double noise : noise_mm)
    if (!(noise > 0)) throw InputError(fmt::format("noise_mm = {}: must be > 0", noise));
}

double robust_residual(double d, double robust_mm) {
  const double t = d / robust_mm;
  return d * std::sqrt(2 / (1 + std::sqrt(1 + t * t)));
}

double robust_slope(double d, double robust_mm) {
  // ½ g² = δ²(s − 1) with s = √(1 + t²), so g g' = d / s.
  const double t = d / robust_mm, s = std::sqrt(1 + t * t);
  return std::sqrt((1 + s) / 2) / s;
}

Fit fit_least_squares(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options) {
  options.check(evaluator.scene());
  std::mt19937 generator(options.seed);
  Fit best, log;
  std::string reason;
  for (int start = 0; start < options.starts; ++start) {
    const Eigen::VectorXd u = start == 0 ? parameters.start() : drawn_start(parameters, generator);
    Fit fit;
    fit.history = std::move(log.history);
    fit.evaluations = log.evaluations, fit.failed = log.failed, fit.iterations = log.iterations;
    fit.start_costs = std::move(log.start_costs);
    try {
      const bool found = best.u.size() > 0;
      search(evaluator, parameters, options, start, u, found ? &best.prediction.solution : options.near, fit);
      fit.start_costs.push_back(fit.cost);
    } catch (const NumericalFailure& failure) {
      reason = failure.what();
      ++fit.failed;
      fit.start_costs.push_back(std::numeric_limits<double>::quiet_NaN());
      fit.u.resize(0);
    }
    log.history = fit.history, log.start_costs = fit.start_costs;
    log.evaluations = fit.evaluations, log.failed = fit.failed, log.iterations = fit.iterations;
    if (fit.u.size() > 0 && (best.u.size() == 0 || fit.cost < best.cost)) best = std::move(fit);
  }
  if (best.u.size() == 0)
    throw NumericalFailure("calibration: no fit from the model's values, nor from any other start: " + reason);
  best.history = std::move(log.history), best.start_costs = std::move(log.start_costs);
  best.evaluations = log.evaluations, best.failed = log.failed, best.iterations = log.iterations;
  return best;
}

Fit refit(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, const Fit& from,
          const Eigen::VectorXd& u, const std::vector<bool>& held) {
  Fit fit;
  fit.u = u;
  fit.mask = from.mask;
  ++fit.evaluations;
  const simulation::ChainSolution near =
      extrapolated(from.prediction.solution, from.linearisation.by_coordinate, u - from.u);
  fit.prediction = evaluator.predict(parameters.model(u), &near);
  FitOptions few = options;
  few.max_iterations = std::min(options.max_iterations, 4);
  descend(evaluator, parameters, few, 0, held, &from.linearisation, true, fit);
  return fit;
}

Fit evaluate_fit(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options,
                 const Eigen::VectorXd& u) {
  Fit fit;
  fit.u = u;
  fit.evaluations = 1;
  fit.prediction = evaluator.predict(parameters.model(u), options.near);
  fit.mask = points_over_skin(fit.prediction);
  fit.residuals = residuals_of(evaluator.scene(), fit.prediction, fit.mask, options.noise_mm);
  const simulation::Sensitivities sensitivities(evaluator.chain(), parameters.model(u), fit.prediction.solution);
  fit.linearisation = linearise(evaluator, sensitivities, parameters, u, fit.prediction, fit.residuals);
  fit.converged = true;
  return fit;
}

}  // namespace supine::calibration
