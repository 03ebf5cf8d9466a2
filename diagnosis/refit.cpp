// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/refit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "calibration/held_out.h"
#include "common/error.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using simulation::Parameter;

constexpr int first_steps = 3;
constexpr double hopeless_share = 0.6;  // of the best gain: what is behind that after the first steps is left there

double rms(const Eigen::VectorXd& d) { return std::sqrt(d.squaredNorm() / static_cast<double>(d.size())); }

/// Strength is what changes the model at its typical size; an effect without such a row is all strength.
bool is_strength(const simulation::Effect& effect, const Parameter& row) {
  const auto& rows = effect.parameters();
  const bool any = std::any_of(rows.begin(), rows.end(), [](const Parameter& r) { return r.median != r.null; });
  return !any || row.median != row.null;
}

/// One candidate on its way. Each has an evaluator of its own, so that it does not matter which thread does what.
struct Job {
  std::string effect;
  simulation::Model model;
  std::optional<FreeParameters> parameters;
  std::unique_ptr<calibration::Evaluator> evaluator;
  std::vector<Eigen::VectorXd> starts;
  WeightedFit fit;
  bool solved = false, finished = false;
  int freedom = 0;
};

/// Base coordinates at their fit, the effect's parameters at @p values.
Eigen::VectorXd start_at(const FreeParameters& parameters, const FreeParameters& base, const Eigen::VectorXd& base_u,
                         const std::vector<std::pair<std::string, double>>& values) {
  Eigen::VectorXd u = parameters.start();
  const auto place = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) - names.begin();
  };
  for (Eigen::Index i = 0; i < base.size(); ++i)
    u[place(parameters.names(), base.names()[static_cast<std::size_t>(i)])] = base_u[i];
  for (const auto& [name, value] : values) {
    const auto i = place(parameters.names(), name);
    if (i < u.size()) u[i] = parameters.coordinate(i, value);
  }
  return parameters.clamped(u);
}

Job prepared(const RefitProblem& problem, const Candidate& candidate, const Score& score) {
  Job job;
  job.effect = candidate.effect;
  job.model = *problem.model;
  job.model.effects.push_back(free_setting(candidate.effect));
  job.parameters.emplace(job.model);
  const FreeParameters base(*problem.model);
  job.freedom = score.freedom;
  std::vector<std::pair<std::string, double>> usual, step;
  bool differ = false;
  for (std::size_t k = 0; k < candidate.parameters.size(); ++k) {
    const CandidateParameter& p = candidate.parameters[k];
    const double wanted = score.step[static_cast<Eigen::Index>(k)];
    const double reach = 3 * p.typical;  // a line drawn further than that is no longer the effect
    const double cut = std::clamp(std::clamp(wanted, p.null - reach, p.null + reach), p.lower, p.upper);
    step.emplace_back(p.name, cut);
    // The slope at the null may point the wrong way where an effect is far from linear.
    const double sign = wanted < p.null && !p.one_sided ? -1 : 1;
    usual.emplace_back(p.name, std::clamp(p.null + sign * p.typical, p.lower, p.upper));
    differ |= std::abs(cut - usual.back().second) > 0.5 * p.typical;
  }
  job.starts.push_back(start_at(*job.parameters, base, problem.base->fit.u, step));
  if (differ && candidate.parameters.size() == 1)
    job.starts.push_back(start_at(*job.parameters, base, problem.base->fit.u, usual));
  return job;
}

/// The better of the starts, and a few steps from there.
void begin(const RefitProblem& problem, Job& job) {
  job.evaluator = std::make_unique<calibration::Evaluator>(problem.scene, job.model);
  const simulation::ChainSolution& near = problem.base->fit.prediction.solution;
  for (const Eigen::VectorXd& u : job.starts) {
    try {
      WeightedFit trial = weigh(*job.evaluator, *job.parameters, *problem.metric, u, &near);
      DescentOptions few;
      few.max_iterations = job.starts.size() > 1 ? 2 : first_steps;
      descend(*job.evaluator, *job.parameters, *problem.metric, few, trial);
      if (!job.solved || trial.objective < job.fit.objective) job.fit = std::move(trial);
      job.solved = true;
    } catch (const NumericalFailure&) {
      // No equilibrium at that size; another start may have one.
    }
  }
}

void finish(const RefitProblem& problem, Job& job) {
  descend(*job.evaluator, *job.parameters, *problem.metric, DescentOptions{}, job.fit);
  job.finished = true;
}

std::vector<FittedParameter> fitted_parameters(const RefitProblem& problem, const Job& job) {
  constexpr double quantile = 1.959964;
  const FreeParameters& parameters = *job.parameters;
  const Eigen::MatrixXd covariance =
      information(job.fit, parameters, *problem.metric).completeOrthogonalDecomposition().pseudoInverse();
  std::vector<FittedParameter> list;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters.names()[static_cast<std::size_t>(i)];
    if (name.rfind(job.effect + ".", 0) != 0) continue;
    const double reach = quantile * std::sqrt(covariance(i, i)), u = job.fit.fit.u[i];
    list.push_back({name, parameters.unit(i), parameters.value(i, u),
                    parameters.value(i, std::max(u - reach, parameters.lower()[i])),
                    parameters.value(i, std::min(u + reach, parameters.upper()[i]))});
  }
  return list;
}

Refit summary(const RefitProblem& problem, Job& job) {
  Refit refit;
  refit.effect = job.effect, refit.solved = job.solved, refit.finished = job.finished, refit.freedom = job.freedom;
  if (!job.solved) return refit;
  const calibration::Fit& fit = job.fit.fit;
  refit.gain = problem.base->objective - job.fit.objective;
  refit.bic = refit.gain - refit.freedom * problem.log_points;
  refit.rms_mm = rms(fit.residuals.distance_mm);
  refit.held_out_rms_mm = rms(calibration::held_out_distances(fit.residuals, fit.linearisation.slope,
                                                              Eigen::VectorXd::Zero(job.parameters->size()),
                                                              calibration::spatial_blocks(fit.residuals)));
  refit.parameters = fitted_parameters(problem, job);
  refit.model = job.parameters->model(fit.u);
  if (job.finished) refit.pose_rms_mm = unfitted_rms_mm(problem, refit.model);
  refit.fit = std::move(job.fit);
  return refit;
}

template <class Work>
void side_by_side(const RefitProblem& problem, std::vector<Job*>& jobs, const std::string& what, Work work) {
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t j = 0; j < jobs.size(); ++j) {
#pragma omp critical(supine_refit_progress)
    if (problem.progress) problem.progress(what + " " + jobs[j]->effect);
    work(*jobs[j]);
  }
}

}  // namespace

simulation::EffectSetting free_setting(const std::string& name) {
  const simulation::Effect& effect = *simulation::find_effect(name);
  simulation::EffectSetting setting = simulation::null_setting(effect);
  for (const Parameter& row : effect.parameters()) {
    if (is_strength(effect, row))
      setting.parameters[row.name] = {row.median, true, {}, row.lower, row.upper};
    else
      setting.parameters[row.name].value = row.median;
  }
  return setting;
}

std::vector<double> unfitted_rms_mm(const RefitProblem& problem, const simulation::Model& model) {
  std::vector<double> all;
  const std::size_t fitted = problem.scene.measurements.size();
  if (problem.whole.measurements.size() == fitted) return all;
  try {
    calibration::Evaluator evaluator(problem.whole, model);
    const calibration::Prediction prediction = evaluator.predict(model);
    for (std::size_t m = fitted; m < problem.whole.measurements.size(); ++m) {
      const auto& distances = prediction.poses[m].distances;
      double sum = 0;
      Eigen::Index count = 0;
      for (Eigen::Index i = 0; i < distances.distance_mm.size(); ++i)
        if (!distances.closest.on_border[i]) sum += std::pow(distances.distance_mm[i], 2), ++count;
      all.push_back(std::sqrt(sum / static_cast<double>(count)));
    }
  } catch (const NumericalFailure&) {
    all.clear();  // that pose has no equilibrium: it says nothing
  }
  return all;
}

std::vector<double> secant_statistics(const RefitProblem& problem, const std::vector<Candidate>& candidates) {
  std::vector<double> statistics(candidates.size(), std::numeric_limits<double>::quiet_NaN());
  const Whitening& whitening = *problem.metric->whitening;
  const calibration::Fit& base = problem.base->fit;
  const Eigen::MatrixXd absorbed = whitening.apply(base.linearisation.slope);
  const auto solver = absorbed.completeOrthogonalDecomposition();
  const auto freed = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    const Eigen::VectorXd white = whitening.apply(d);
    return white - absorbed * solver.solve(white);
  };
  const Eigen::VectorXd left = freed(base.residuals.distance_mm + problem.metric->mean_mm);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const auto& rows = candidates[c].parameters;
    simulation::EffectSetting setting = free_setting(candidates[c].effect);
    const Parameter* row = simulation::find_parameter(rows[0].name);
    if (rows.size() != 1 || row->median == row->null) continue;
    simulation::Model model = *problem.model;
    model.effects.push_back(setting);
    try {
      calibration::Evaluator evaluator(problem.scene, model);
      const calibration::Prediction moved = evaluator.predict(model, &base.prediction.solution);
      const auto there = calibration::residuals_of(problem.scene, moved, base.mask, problem.metric->noise_mm);
      const Eigen::VectorXd change = freed(there.distance_mm - base.residuals.distance_mm);
      const double along = -change.dot(left);
      if (along > 0 || !rows[0].one_sided) statistics[c] = along * along / change.squaredNorm();
    } catch (const NumericalFailure&) {
      // No equilibrium at the usual size: the slope at the null has to do.
    }
  }
  return statistics;
}

std::vector<Refit> refit_candidates(const RefitProblem& problem, const std::vector<Candidate>& candidates,
                                    const ScoreTable& table, const std::vector<std::string>& which) {
  std::vector<Job> jobs;
  for (const std::string& effect : which)
    for (const Candidate& candidate : candidates)
      for (const Score& score : table.scores)
        if (candidate.effect == effect && score.effect == effect) jobs.push_back(prepared(problem, candidate, score));
  std::vector<Job*> order;
  for (Job& job : jobs) order.push_back(&job);
  side_by_side(problem, order, "refit with", [&problem](Job& job) { begin(problem, job); });
  double best = 0;
  for (const Job& job : jobs)
    if (job.solved) best = std::max(best, problem.base->objective - job.fit.objective);
  order.clear();
  for (Job& job : jobs)
    if (job.solved && problem.base->objective - job.fit.objective >= hopeless_share * best) order.push_back(&job);
  side_by_side(problem, order, "to the end with", [&problem](Job& job) { finish(problem, job); });
  std::vector<Refit> refits(jobs.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t j = 0; j < jobs.size(); ++j) refits[j] = summary(problem, jobs[j]);
  std::stable_sort(refits.begin(), refits.end(), [](const Refit& a, const Refit& b) { return a.bic > b.bic; });
  return refits;
}

}  // namespace supine::diagnosis
