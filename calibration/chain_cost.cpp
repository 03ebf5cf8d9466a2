// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/chain_cost.h"

#include <cmath>
#include <limits>

#include "common/error.h"

namespace supine::calibration {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
/// In ln(value): a modulus goes by a factor of 4.5 at most. A first step from far away may ask for a tissue that cannot
/// carry itself, and finding that out costs more than many runs.
constexpr double longest_step = 1.5;

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
  set_num_residuals(static_cast<int>(points) + prior_count(parameters, options));
  mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(parameters.size()), 1);
}

void ChainCost::warm_start(const Eigen::VectorXd& u, const Prediction& prediction, const Linearisation* linearisation) {
  accepted_.u = u;
  accepted_.prediction = prediction;
  if (linearisation != nullptr) accepted_.linearisation = *linearisation;
  trial_ = accepted_;
  trial_.residuals = residuals_of(evaluator_.scene(), prediction, mask_, options_.noise_mm);
  if (linearisation == nullptr) note(u, false);
}

bool ChainCost::too_far(const Eigen::VectorXd& u) const {
  for (Eigen::Index j = 0; j < u.size() && accepted_.u.size() == u.size(); ++j)
    if (parameters_.is_log(j) && std::abs(u[j] - accepted_.u[j]) > longest_step) return true;
  return false;
}

bool ChainCost::predict(const Eigen::VectorXd& u) const {
  if (trial_.u.size() == u.size() && trial_.u == u) return true;
  if (too_far(u)) return false;  // the line search comes closer
  ++log_.evaluations;
  try {
    const bool warm = accepted_.u.size() == u.size();
    simulation::ChainSolution near;
    if (warm)
      near = extrapolated(accepted_.prediction.solution, accepted_.linearisation.by_coordinate, u - accepted_.u);
    trial_.prediction = evaluator_.predict(parameters_.model(u), warm ? &near : nullptr);
  } catch (const NumericalFailure&) {
    ++log_.failed;
    note(u, true);
    return false;
  }
  trial_.u = u;
  trial_.residuals = residuals_of(evaluator_.scene(), trial_.prediction, mask_, options_.noise_mm);
  note(u, false);
  return true;
}

void ChainCost::note(const Eigen::VectorXd& u, bool failed) const {
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
  if (options_.progress) options_.progress({log_.evaluations, log_.failed, row.rms_mm, best_rms_mm_});
}

Eigen::VectorXd ChainCost::weighted(const State& state) const {
  Eigen::VectorXd residuals(num_residuals());
  const Residuals& r = state.residuals;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    residuals[i] = robust_residual(r.distance_mm[i], options_.robust_mm) / r.sigma_mm[i];
  Eigen::Index row = r.size();
  for (Eigen::Index j = 0; j < state.u.size() && row < num_residuals(); ++j)
    if (const auto& prior = parameters_.priors()[static_cast<std::size_t>(j)])
      residuals[row++] = (state.u[j] - prior->mean) / prior->sd;
  return residuals;
}

void ChainCost::accept(const Eigen::VectorXd& residuals) const {
  const Eigen::VectorXd& u = trial_.u;
  const simulation::Sensitivities sensitivities(evaluator_.chain(), parameters_.model(u), trial_.prediction.solution);
  trial_.linearisation = linearise(evaluator_, sensitivities, parameters_, u, trial_.prediction, trial_.residuals);
  trial_.cost = 0.5 * residuals.squaredNorm();
  trial_.jacobian.setZero(num_residuals(), u.size());
  const Residuals& r = trial_.residuals;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    trial_.jacobian.row(i) =
        trial_.linearisation.slope.row(i) * (robust_slope(r.distance_mm[i], options_.robust_mm) / r.sigma_mm[i]);
  Eigen::Index row = r.size();
  for (Eigen::Index j = 0; j < u.size() && row < num_residuals(); ++j)
    if (const auto& prior = parameters_.priors()[static_cast<std::size_t>(j)])
      trial_.jacobian(row++, j) = 1 / prior->sd;
  trial_.gradient = trial_.jacobian.transpose() * residuals;
  trial_.information = trial_.jacobian.transpose() * trial_.jacobian;
  accepted_ = trial_;
  if (!log_.history.empty()) log_.history.back().accepted = true;
}

bool ChainCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Eigen::VectorXd u(parameters_.size());
  for (Eigen::Index j = 0; j < u.size(); ++j) u[j] = parameters[j][0];
  const bool known = accepted_.jacobian.size() > 0 && accepted_.u == u;
  if (!known && !predict(u)) return false;
  const Eigen::VectorXd values = weighted(known ? accepted_ : trial_);
  Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = values;
  if (jacobians == nullptr) return true;
  if (!known) accept(values);
  for (Eigen::Index j = 0; j < u.size(); ++j)
    if (jacobians[j] != nullptr) Eigen::Map<Eigen::VectorXd>(jacobians[j], num_residuals()) = accepted_.jacobian.col(j);
  return true;
}

}  // namespace supine::calibration
