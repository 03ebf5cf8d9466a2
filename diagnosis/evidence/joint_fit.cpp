// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/joint_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/work_limit.h"
#include "common/error.h"
#include "common/rms.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double settled = 0.3;       // of F: a further step gains no more
constexpr double longest_step = 1.0;  // of a coordinate of a parameter: e
constexpr int most_halvings = 4;
constexpr double other_moduli[] = {0.5, 2, 0.7, 1.4, 0.35, 2.8, 0.25, 4};

void note(const VectorXd& u, bool failed, JointFit& fit) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  if (!fit.keeps_history) return;
  calibration::FitEvaluation row{fit.parameters->values(u), nan, nan, nan, failed, false, 0};
  if (!failed) {
    const VectorXd skin = fit.fit.residuals.skin_mm();
    row.mae_study_mm = fit.fit.prediction.mae_study_mm();
    row.mae_mm = skin.cwiseAbs().mean();
    row.rms_mm = rms(skin);
  }
  fit.history.push_back(row);
}

void solve(calibration::Evaluator& evaluator, const std::vector<std::string>& poses, const JointTrial& at,
           const simulation::ChainSolution* near, const BaseFit& ground, JointFit& fit) {
  fit.model = with_nuisances(fit.parameters->model(at.u), at.nuisances, poses);
  fit.fit.u = at.u;
  fit.fit.prediction = evaluator.predict(fit.model, near);
  fit.nuisances = at.nuisances;
  if (fit.fit.mask.empty()) fit.fit.mask = calibration::points_over_skin(fit.fit.prediction);
  fit.fit.residuals = calibration::residuals_of(evaluator.scene(), fit.fit.prediction, fit.fit.mask, ground.noise_mm);
  ++fit.evaluations;
  note(at.u, false, fit);
}

/// Coordinates with every Young's modulus of the base model so many times as stiff.
VectorXd scaled(const FreeParameters& parameters, VectorXd u, double times) {
  for (Index i = 0; i < u.size(); ++i)
    if (parameters.names()[static_cast<std::size_t>(i)].ends_with("young_modulus_kpa"))
      u[i] = parameters.coordinate(i, times * parameters.value(i, u[i]));
  return parameters.clamped(u);
}

/// The first prediction: from moduli at which the body is lost no step leads back, so others are tried there.
void solve_first(calibration::Evaluator& evaluator, const std::vector<std::string>& poses, const JointTrial& at,
                 const simulation::ChainSolution* near, const BaseFit& ground, JointFit& fit) {
  solve(evaluator, poses, at, near, ground, fit);
  if (rms(fit.fit.residuals.skin_mm()) < lost_mm) return;
  const calibration::PointMask mask = fit.fit.mask;
  JointFit best = fit;
  const calibration::TrialLimit limit(evaluator.chain(), fit.fit.prediction.solution.dearest_solve);
  for (const double times : other_moduli) {
    JointFit trial = fit;
    trial.fit.mask = mask;
    try {
      solve(evaluator, poses, {scaled(*fit.parameters, at.u, times), at.nuisances}, nullptr, ground, trial);
    } catch (const NumericalFailure&) {
      continue;  // no equilibrium with these, or none that costs as little
    }
    fit.evaluations = trial.evaluations, fit.history = trial.history;
    if (rms(trial.fit.residuals.skin_mm()) < rms(best.fit.residuals.skin_mm())) best = std::move(trial);
  }
  best.evaluations = fit.evaluations, best.history = std::move(fit.history);
  fit = std::move(best);
}

}  // namespace

simulation::ChainSolution expected_at(const JointTrial& trial, const calibration::Fit& from,
                                      const std::vector<Nuisance>& nuisances) {
  simulation::ChainSolution near =
      calibration::extrapolated(from.prediction.solution, from.linearisation.by_coordinate, trial.u - from.u);
  for (std::size_t k = 0; k < nuisances.size(); ++k)
    move_along(nuisances[k], trial.nuisances[k].value - nuisances[k].value, near);
  return near;
}

JointFitter::JointFitter(calibration::Evaluator& evaluator, JointFit& fit, const BaseFit& ground)
    : evaluator_(evaluator), fit_(fit), ground_(ground), poses_(poses_of(evaluator.scene())) {}

JointTrial JointFitter::stepped(const VectorXd& step) const {
  const Index own = fit_.fit.u.size();
  JointTrial trial{fit_.parameters->clamped(fit_.fit.u + step.head(own)), fit_.nuisances};
  for (Index k = own; k < step.size(); ++k) trial.nuisances[static_cast<std::size_t>(k - own)].value += step[k];
  return trial;
}

double JointFitter::objective_of(const VectorXd& distances, const JointTrial& at) const {
  double sum =
      ground_.covariance->square(distances, fit_.size_mm) + fit_.parameters->prior_deviation(at.u).squaredNorm();
  for (const Nuisance& nuisance : at.nuisances) sum += nuisance.value * nuisance.value;
  return sum;
}

double JointFitter::objective() const {
  return objective_of(ground_.distances(fit_.fit.residuals), {fit_.fit.u, fit_.nuisances});
}

void JointFitter::predict(const JointTrial& at, const simulation::ChainSolution* near) {
  const bool first = fit_.fit.residuals.size() == 0;
  if (first)
    solve_first(evaluator_, poses_, at, near, ground_, fit_);
  else
    solve(evaluator_, poses_, at, near, ground_, fit_);
  if (!first) return;
  for (calibration::FitEvaluation& row : fit_.history) row.accepted = row.values == fit_.parameters->values(fit_.fit.u);
  // A trial goes on from shapes: worth half as much again as one from nothing (TrialLimit gives it three times this).
  const int work = fit_.fit.prediction.solution.dearest_solve;
  fit_.dearest = std::max(fit_.dearest, near != nullptr ? std::max(work, near->dearest_solve) : work / 2);
}

std::unique_ptr<simulation::Sensitivities> JointFitter::linearise() {
  auto sensitivities =
      std::make_unique<simulation::Sensitivities>(evaluator_.chain(), fit_.model, fit_.fit.prediction.solution);
  const FreeParameters there(with_nuisances(fit_.parameters->base(), fit_.nuisances, poses_));
  fit_.fit.linearisation =
      calibration::linearise(evaluator_, *sensitivities, there, fit_.fit.u, fit_.fit.prediction, fit_.fit.residuals);
  find_shapes(evaluator_, *sensitivities, fit_.model, fit_.fit.prediction, fit_.fit.residuals, fit_.nuisances);
  return sensitivities;
}

bool JointFitter::improve() {
  const LinearEvidence evidence = evidence_of(ground_, fit_);
  const VectorXd& y = evidence.distances();
  const Weighed weighed = evidence.weigh_all();
  fit_.size_mm = ground_.size_of(weighed);
  VectorXd step = weighed.mean[weighed.likeliest()];
  const double longest = step.head(fit_.fit.u.size()).cwiseAbs().maxCoeff();
  if (longest > longest_step) step *= longest_step / longest;
  const JointTrial now{fit_.fit.u, fit_.nuisances};
  const double before = objective_of(y, now);
  const double promised = before - objective_of(y + evidence.directions().columns * step, stepped(step));
  if (promised < settled) return false;
  const calibration::Fit kept = fit_.fit;
  if (fit_.dearest == 0) fit_.dearest = kept.prediction.solution.dearest_solve;
  const simulation::Model kept_model = fit_.model;
  step *= share_;
  for (int halving = 0; halving < most_halvings; ++halving, step *= 0.5) {
    fit_.fit.u = kept.u, fit_.nuisances = now.nuisances;
    const JointTrial trial = stepped(step);
    const simulation::ChainSolution near = expected_at(trial, kept, now.nuisances);
    try {
      const calibration::TrialLimit limit(evaluator_.chain(), fit_.dearest);
      predict(trial, &near);
      const double gain = before - objective();
      if (gain > 0) {
        ++fit_.steps;
        fit_.dearest = std::max(fit_.dearest, fit_.fit.prediction.solution.dearest_solve);
        share_ = halving == 0 ? std::min(1.0, 2 * share_) : share_ * std::pow(0.5, halving);
        if (fit_.keeps_history) fit_.history.back().accepted = true;
        return gain > settled;
      }
    } catch (const NumericalFailure&) {
      note(trial.u, true, fit_);  // no equilibrium there: a shorter step
    }
    if (promised < worth_shortening) break;
  }
  fit_.fit = kept, fit_.model = kept_model, fit_.nuisances = now.nuisances;
  return false;
}

void JointFitter::descend(int most_steps, const std::function<void()>& before_step) {
  for (int step = 0; step < most_steps; ++step) {
    if (before_step) before_step();
    const int before = fit_.steps;
    const bool gained = improve();
    if (fit_.steps > before) linearise();
    if (!gained) break;
  }
}

}  // namespace supine::diagnosis
