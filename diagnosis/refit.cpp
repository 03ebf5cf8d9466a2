// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/refit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "calibration/held_out.h"
#include "common/error.h"
#include "common/rms.h"
#include "common/statistics.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using simulation::Parameter;

constexpr int first_steps = 3;
constexpr double place_start_sd = 1.5;  // how far to either side of its usual place an effect is looked for
constexpr double hopeless_share = 0.6;  // of the best gain: what is behind that after the first steps is left there
constexpr double tolerated_hopeless_share = 0.25;  // of an effect that errors may imitate: they take half of its gain

/// One candidate on its way. Each has an evaluator of its own, so that it does not matter which thread does what.
struct Job {
  std::string effect;
  simulation::Model model;
  std::optional<FreeParameters> parameters;
  std::unique_ptr<calibration::Evaluator> evaluator;
  std::vector<Eigen::VectorXd> starts;
  Whitening whitening;  // without the tolerance for the effect itself
  Metric metric;        // of that whitening
  WeightedFit fit;
  double objective = 0;  // F of the fit under all errors, as the base model's
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
  job.model = *problem.given;
  job.model.effects.push_back(free_setting(candidate.effect));
  job.parameters.emplace(job.model);
  const FreeParameters base(*problem.given);
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
  job.starts.push_back(start_at(*job.parameters, base, problem.base->solution.u, step));
  if (differ && candidate.parameters.size() == 1)
    job.starts.push_back(start_at(*job.parameters, base, problem.base->solution.u, usual));
  // Without strength a place moves nothing, and at the wrong place a one-sided strength falls to nothing and stays
  // there: look on either side too.
  const bool falls = std::any_of(candidate.parameters.begin(), candidate.parameters.end(),
                                 [](const CandidateParameter& p) { return p.one_sided; });
  for (const Parameter& row : simulation::find_effect(candidate.effect)->parameters()) {
    const bool place = row.shape && row.lower < 0;
    if (!falls || !place) continue;
    for (const double side : {-place_start_sd, place_start_sd}) {
      auto elsewhere = usual;
      elsewhere.emplace_back(candidate.effect + "." + row.name, row.median + side * row.spread);
      job.starts.push_back(start_at(*job.parameters, base, problem.base->solution.u, elsewhere));
    }
  }
  return job;
}

void weigh_under_all_errors(const RefitProblem& problem, Job& job) {
  WeightedFit fit = job.fit;
  weigh_again(*job.parameters, *problem.metric, fit);
  job.objective = fit.objective;
}

/// The better of the starts, and a few steps from there.
void begin(const RefitProblem& problem, Job& job) {
  job.whitening = Whitening::of(problem.base->solution.residuals, without_tolerance_for(job.effect, *problem.sources));
  job.metric = *problem.metric;
  job.metric.whitening = &job.whitening;
  job.evaluator = std::make_unique<calibration::Evaluator>(problem.scene, job.model, accurate_enough());
  const simulation::ChainSolution& near = problem.base->solution.prediction.solution;
  for (const Eigen::VectorXd& u : job.starts) {
    try {
      WeightedFit trial = weigh(*job.evaluator, *job.parameters, job.metric, u, &near);
      DescentOptions few;
      few.max_iterations = job.starts.size() > 1 ? 2 : first_steps;
      descend(*job.evaluator, *job.parameters, job.metric, few, trial);
      if (!job.solved || trial.objective < job.fit.objective) job.fit = std::move(trial);
      job.solved = true;
    } catch (const NumericalFailure&) {
      // No equilibrium at that size; another start may have one.
    }
  }
  if (job.solved) weigh_under_all_errors(problem, job);
}

void finish(const RefitProblem& problem, Job& job) {
  descend(*job.evaluator, *job.parameters, job.metric, DescentOptions{}, job.fit);
  weigh_under_all_errors(problem, job);
  job.finished = true;
}

/// What the data say of place and shape beyond the prior costs, as in Laplace's evidence.
double occam(const Job& job) {
  const auto& priors = job.parameters->priors();
  const auto shape = [&job, &priors](Eigen::Index i) {
    const auto k = static_cast<std::size_t>(i);
    return priors[k] && job.parameters->names()[k].rfind(job.effect + ".", 0) == 0;
  };
  const Eigen::MatrixXd covariance = covariance_of(information(job.fit, *job.parameters, job.metric));
  std::vector<int> rows;
  double prior = 0;
  for (int i = 0; i < static_cast<int>(job.parameters->size()); ++i)
    if (shape(i)) rows.push_back(i), prior += 2 * std::log(priors[static_cast<std::size_t>(i)]->sd);
  if (rows.empty()) return 0;
  const Eigen::MatrixXd left = covariance(rows, rows);
  return std::max(0.0, prior - std::log(left.determinant()));
}

/// Whether a place or width of the effect would rather be beyond its range.
bool is_at_border(const Job& job) {
  constexpr double close = 0.01;  // of the range
  const FreeParameters& parameters = *job.parameters;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters.names()[static_cast<std::size_t>(i)];
    if (!name.starts_with(job.effect + ".") || !simulation::find_parameter(name)->shape) continue;
    const double low = parameters.lower()[i], high = parameters.upper()[i], u = job.fit.solution.u[i];
    if (std::min(u - low, high - u) < close * (high - low)) return true;
  }
  return false;
}

Refit summary(const RefitProblem& problem, Job& job) {
  Refit refit;
  refit.effect = job.effect, refit.solved = job.solved, refit.finished = job.finished, refit.freedom = job.freedom;
  if (!job.solved) return refit;
  const calibration::Fit& fit = job.fit.solution;
  refit.at_border = is_at_border(job);
  refit.gain = problem.base->objective - job.objective;
  refit.bic = refit.gain - refit.freedom * problem.log_points - occam(job);
  refit.rms_mm = rms(fit.residuals.distance_mm);
  refit.held_out_rms_mm =
      rms(calibration::held_out_distances(fit.residuals, fit.linearisation.slope, job.parameters->prior_information(),
                                          calibration::spatial_blocks(fit.residuals)));
  refit.parameters = linear_intervals(job.effect, job.fit, *job.parameters, *problem.metric);
  refit.model = job.parameters->model(fit.u), refit.given = job.model;
  if (job.finished) {
    const OtherPoses others =
        other_poses_of_refit(problem.whole, *job.parameters, job.fit, *problem.sources, *problem.others);
    refit.pose_rms_mm = others.rms_mm();
    refit.pose_change_mm = others.change_mm(*problem.others);
    if (!refit.pose_rms_mm.empty()) {
      refit.pose_gain = problem.others->objective - others.objective;
      refit.pose_misfit = others.misfit;
    }
  }
  refit.fit = std::move(job.fit);
  return refit;
}

double hopeless_share_of(const std::string& effect) {
  return errors_imitate(effect) ? tolerated_hopeless_share : hopeless_share;
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

bool unfitted_scans_judge(const Refit& refit, std::size_t unfitted_poses) {
  return unfitted_poses > 0 && !refit.pose_rms_mm.empty() && !simulation::traits_of(refit.effect).moves_scan;
}

simulation::EffectSetting free_setting(const std::string& name) {
  const simulation::Effect& effect = *simulation::find_effect(name);
  simulation::EffectSetting setting = simulation::null_setting(effect);
  for (const Parameter& row : effect.parameters()) {
    setting.parameters[row.name] = {row.median, true, {}, row.lower, row.upper};
    if (row.shape) setting.parameters[row.name].prior_sd = simulation::prior_sd(row);
  }
  return setting;
}

std::vector<FittedParameter> linear_intervals(const std::string& effect, const WeightedFit& fit,
                                              const FreeParameters& parameters, const Metric& metric) {
  const Eigen::MatrixXd covariance = covariance_of(information(fit, parameters, metric));
  const double wider = std::sqrt(std::max(1.0, misfit_of(fit, parameters, metric)));
  std::vector<FittedParameter> list;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters.names()[static_cast<std::size_t>(i)];
    if (name.rfind(effect + ".", 0) != 0) continue;
    const double reach = wider * normal_reach95() * std::sqrt(covariance(i, i)), u = fit.solution.u[i];
    list.push_back({name, parameters.unit(i), parameters.value(i, u),
                    parameters.value(i, std::max(u - reach, parameters.lower()[i])),
                    parameters.value(i, std::min(u + reach, parameters.upper()[i]))});
  }
  return list;
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
    if (job.solved) best = std::max(best, problem.base->objective - job.objective);
  order.clear();
  for (Job& job : jobs)
    if (job.solved && problem.base->objective - job.objective >= hopeless_share_of(job.effect) * best)
      order.push_back(&job);
  side_by_side(problem, order, "to the end with", [&problem](Job& job) { finish(problem, job); });
  std::vector<Refit> refits(jobs.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t j = 0; j < jobs.size(); ++j) refits[j] = summary(problem, jobs[j]);
  std::stable_sort(refits.begin(), refits.end(), [](const Refit& a, const Refit& b) { return a.bic > b.bic; });
  return refits;
}

}  // namespace supine::diagnosis
