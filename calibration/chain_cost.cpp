// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/chain_cost.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/tissue_range.h"
#include "calibration/work_limit.h"
#include "common/error.h"

namespace supine::calibration {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

int prior_count(const FreeParameters& parameters, const FitOptions& options) {
  if (!options.use_priors) return 0;
  int count = 0;
  for (const auto& prior : parameters.priors()) count += prior.has_value();
  return count;
}

}  // namespace

ChainCost::ChainCost(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, PointMask mask,
                     Fit& log, int start)
    : evaluator_(evaluator),
      parameters_(parameters),
      options_(options),
      mask_(std::move(mask)),
      log_(log),
      start_(start),
      best_rms_mm_(std::numeric_limits<double>::infinity()) {
  Eigen::Index points = 0;
  for (const auto& used : mask_) points += used.count();
  rows_ = points + prior_count(parameters, options);
}

void ChainCost::warm_start(const Eigen::VectorXd& u, const Prediction& prediction, const Linearisation* linearisation) {
  accepted_.u = u;
  accepted_.prediction = prediction;
  if (linearisation != nullptr) accepted_.linearisation = *linearisation;
  trial_ = accepted_;
  trial_.residuals = residuals_of(evaluator_.scene(), prediction, mask_, options_.noise_mm);
  trial_.own = own_rows(prediction);
  rows_ += trial_.own.size();
  dearest_ = prediction.solution.dearest_solve;
  if (options_.near != nullptr) dearest_ = std::max(dearest_, options_.near->dearest_solve);
  linearise_trial();
  if (linearisation != nullptr) return;
  note(u, false);
  log_.history.back().accepted = true;
}

std::optional<double> ChainCost::attempt(const Eigen::VectorXd& u) {
  ++log_.evaluations;
  try {
    const TrialLimit limit(evaluator_.chain(), dearest_);
    const simulation::ChainSolution near =
        extrapolated(accepted_.prediction.solution, accepted_.linearisation.by_coordinate, u - accepted_.u);
    trial_.prediction = evaluator_.predict(parameters_.model(u), &near);
  } catch (const NumericalFailure&) {
    ++log_.failed;
    note(u, true);
    return {};
  }
  trial_.u = u;
  trial_.residuals = residuals_of(evaluator_.scene(), trial_.prediction, mask_, options_.noise_mm);
  trial_.own = own_rows(trial_.prediction);
  trial_.cost = 0.5 * weighted(trial_).squaredNorm();
  note(u, false);
  return trial_.cost;
}

void ChainCost::note(const Eigen::VectorXd& u, bool failed) {
  const Eigen::VectorXd& d = trial_.residuals.distance_mm;
  const double count = static_cast<double>(d.size());
  FitEvaluation row{parameters_.values(u), nan, nan, nan, failed, false, start_};
  if (!failed) {
    row.mae_study_mm = trial_.prediction.mae_study_mm();
    row.mae_mm = d.cwiseAbs().sum() / count;
    row.rms_mm = std::sqrt(d.squaredNorm() / count);
    best_rms_mm_ = std::min(best_rms_mm_, row.rms_mm);
  }
  log_.history.push_back(row);
  if (options_.progress)
    options_.progress(
        {log_.evaluations, log_.failed, row.rms_mm, best_rms_mm_, !outside_tissue(parameters_, u).empty()});
}

Eigen::VectorXd ChainCost::weighted(const State& state) const {
  Eigen::VectorXd residuals(rows_);
  const Residuals& r = state.residuals;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    residuals[i] = robust_residual(r.distance_mm[i], options_.robust_mm) / r.sigma_mm[i];
  residuals.segment(r.size(), state.own.size()) = state.own;
  Eigen::Index row = r.size() + state.own.size();
  for (Eigen::Index j = 0; j < state.u.size() && row < rows_; ++j)
    if (const auto& prior = parameters_.priors()[static_cast<std::size_t>(j)])
      residuals[row++] = (state.u[j] - prior->mean) / prior->sd;
  return residuals;
}

Eigen::VectorXd ChainCost::own_rows(const Prediction& prediction) const {
  Eigen::VectorXd rows;
  for (const OwnResidual* own : options_.own) {
    const Eigen::VectorXd more = own->value(prediction.solution);
    const Eigen::Index before = rows.size();
    rows.conservativeResize(before + more.size());
    rows.tail(more.size()) = more;
  }
  const Eigen::Index expected = accepted_.own.size();
  if (accepted_.gradient.size() > 0 && rows.size() != expected)
    throw InputError(fmt::format("own residuals: {} rows, and {} at another shape; their number must stay the same",
                                 rows.size(), expected));
  return rows;
}

Eigen::MatrixXd ChainCost::own_slopes(const State& state) const {
  Eigen::MatrixXd slopes(state.own.size(), state.u.size());
  for (Eigen::Index j = 0; j < slopes.cols(); ++j) {
    Eigen::Index row = 0;
    for (const OwnResidual* own : options_.own) {
      const Eigen::VectorXd change =
          own->change(state.prediction.solution, state.linearisation.by_coordinate[static_cast<std::size_t>(j)]);
      if (row + change.size() > slopes.rows())
        throw InputError(fmt::format("own residual {}: its derivative has more rows than its value", own->name()));
      slopes.col(j).segment(row, change.size()) = change;
      row += change.size();
    }
    if (row != slopes.rows())
      throw InputError(fmt::format("own residuals: derivatives of {} rows, values of {}", row, slopes.rows()));
  }
  return slopes;
}

void ChainCost::accept() {
  linearise_trial();
  log_.history.back().accepted = true;
}

void ChainCost::linearise_trial() {
  const Eigen::VectorXd& u = trial_.u;
  const simulation::Sensitivities sensitivities(evaluator_.chain(), parameters_.model(u), trial_.prediction.solution);
  trial_.linearisation = linearise(evaluator_, sensitivities, parameters_, u, trial_.prediction, trial_.residuals);
  const Eigen::VectorXd residuals = weighted(trial_);
  trial_.cost = 0.5 * residuals.squaredNorm();
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows_, u.size());
  const Residuals& r = trial_.residuals;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    jacobian.row(i) =
        trial_.linearisation.slope.row(i) * (robust_slope(r.distance_mm[i], options_.robust_mm) / r.sigma_mm[i]);
  const Eigen::Index own = trial_.own.size();
  if (own > 0) {
    jacobian.middleRows(r.size(), own) = own_slopes(trial_);
    trial_.own_information = jacobian.middleRows(r.size(), own).transpose() * jacobian.middleRows(r.size(), own);
  }
  Eigen::Index row = r.size() + own;
  for (Eigen::Index j = 0; j < u.size() && row < rows_; ++j)
    if (const auto& prior = parameters_.priors()[static_cast<std::size_t>(j)]) jacobian(row++, j) = 1 / prior->sd;
  trial_.gradient = jacobian.transpose() * residuals;
  trial_.information = jacobian.transpose() * jacobian;
  trial_.rows = rows_;
  dearest_ = std::max(dearest_, trial_.prediction.solution.dearest_solve);
  accepted_ = trial_;
}

}  // namespace supine::calibration
