// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/examine.h"

#include <algorithm>
#include <cmath>

#include "calibration/held_out.h"
#include "calibration/uncertainty.h"
#include "common/error.h"
#include "common/rms.h"
#include "diagnosis/intervals.h"
#include "diagnosis/secants.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;

constexpr double far_from_given = 0.7;  // a factor of 2
constexpr double least_worth = 3;
constexpr double worth_share = 0.05;  // of the best score: what is further behind is not refitted

void tell(const ExamineOptions& options, const std::string& what) {
  if (options.progress) options.progress(what);
}

void measure_mesh(const Subject& subject, const simulation::Model& model, const calibration::Fit& fit,
                  const ExamineOptions& options, Findings& found) {
  const std::optional<NumericalError> before = std::move(found.numerical);
  found.numerical.reset();
  found.numerical_failure.clear();
  if (!options.other_meshes) {
    found.numerical_failure = "not asked for";
    return;
  }
  tell(options, "two other meshes");
  try {
    found.numerical = measure_numerical_error(subject.fitted, model, fit, before ? &*before : nullptr);
  } catch (const NumericalFailure& failure) {
    found.numerical_failure = failure.what();
  }
}

/// What is known of the errors, at coordinates @p u, and the least of F under them from there.
/// @param near  solution of @p u, or nullptr
void fit_from(const Subject& subject, calibration::Evaluator& evaluator, const FreeParameters& parameters,
              const Eigen::VectorXd& u, const simulation::ChainSolution* near, const ExamineOptions& options,
              Findings& found) {
  calibration::FitOptions as_given;
  as_given.noise_mm = subject.noise_mm;
  as_given.near = near;
  tell(options, "sensitivities");
  const calibration::Fit fit = calibration::evaluate_fit(evaluator, parameters, as_given, u);
  const simulation::Model model = parameters.model(u);
  const auto errors = calibration::fit_error_model(fit.residuals, fit.linearisation.slope);
  measure_mesh(subject, model, fit, options, found);
  found.unseen.clear();
  const auto candidates = find_candidates(evaluator, model, fit, found.unseen);
  found.sources = error_sources(fit.residuals, candidates, found.numerical ? &*found.numerical : nullptr, errors,
                                options.tolerances);
  found.whitening = Whitening::of(fit.residuals, found.sources);
  found.metric = {&found.whitening, found.sources.mean_mm, fit.mask, subject.noise_mm};
  tell(options, "fit under all errors");
  found.base = weigh(evaluator, parameters, found.metric, u, &fit.prediction.solution);
  descend(evaluator, parameters, found.metric, DescentOptions{}, found.base);
}

/// How far a modulus is from the one given, in its logarithm.
double farthest_modulus(const FreeParameters& parameters, const Eigen::VectorXd& u) {
  double farthest = 0;
  const auto is_shape = [&parameters](Eigen::Index i) {
    return simulation::find_parameter(parameters.names()[static_cast<std::size_t>(i)])->shape;
  };
  for (Eigen::Index i = 0; i < u.size(); ++i)
    if (parameters.is_log(i) && !is_shape(i)) farthest = std::max(farthest, std::abs(u[i] - parameters.start()[i]));
  return farthest;
}

/// Errors from the model as given; then the base model at the least of F, and the catalogue there.
void fit_base(const Subject& subject, calibration::Evaluator& evaluator, const ExamineOptions& options,
              Findings& found) {
  const FreeParameters parameters(subject.model);
  fit_from(subject, evaluator, parameters, parameters.start(), subject.near, options, found);
  // Where something is missing a calibration may end at moduli no body has: errors measured there are not the body's.
  if (farthest_modulus(parameters, found.base.solution.u) > far_from_given) {
    const calibration::Fit first = std::move(found.base.solution);
    fit_from(subject, evaluator, parameters, first.u, &first.prediction.solution, options, found);
  }
  tell(options, "catalogue");
  found.model = parameters.model(found.base.solution.u);
  found.free = parameters.names();
  found.unseen.clear();
  found.candidates = find_candidates(evaluator, found.model, found.base.solution, found.unseen);
}

void judge_base(const Subject& subject, Findings& found) {
  const FreeParameters parameters(subject.model);
  const calibration::Fit& fit = found.base.solution;
  BaseFigures& f = found.figures;
  f.rms_mm = rms(fit.residuals.distance_mm);
  f.held_out_rms_mm =
      rms(calibration::held_out_distances(fit.residuals, fit.linearisation.slope, parameters.prior_information(),
                                          calibration::spatial_blocks(fit.residuals)));
  f.noise_mm = rms(found.sources.noise_mm);
  f.left = lack_of_fit(found.base, found.metric);
}

/// Whether chance gives what is seen: nothing is refitted then.
bool is_quiet(const Findings& found, const VerdictRules& rules) {
  return !found.table.scores.empty() && found.table.scores.front().p_value >= rules.p_value &&
         found.figures.left.p_value >= rules.lack_of_fit_p;
}

/// @param corrected  by what finer elements change there
void judge_by_other_poses(const Subject& subject, const ExamineOptions& options, bool corrected, Findings& found) {
  const bool any = subject.whole.measurements.size() > subject.fitted.measurements.size();
  if (any && corrected && found.numerical) {
    tell(options, "finer mesh in poses that are not fitted");
    for (const Eigen::VectorXd& change : measure_unfitted_error(subject.whole, *found.numerical))
      found.sources.unfitted_mean_mm.push_back(options.tolerances.correction * change);
  }
  if (any) tell(options, "poses that are not fitted");
  found.others = other_poses_of_base(subject.whole, FreeParameters(subject.model), found.base, found.sources,
                                     found.metric, options.tolerances);
  found.figures.pose_rms_mm = found.others.rms_mm(), found.figures.pose_noise_mm = found.others.noise_mm;
  found.figures.unfitted_poses = found.others.unfitted;
}

/// Sizes and intervals of what is named, with the mesh's error measured again where it is in the model.
void settle_named(const Subject& subject, const ExamineOptions& options, Findings& found) {
  constexpr std::size_t most = 3;
  const auto& names = found.diagnosis.missing;
  if (found.diagnosis.verdict == Verdict::nothing_missing) return;
  for (std::size_t n = 0; n < std::min(most, names.size()); ++n)
    for (Refit& refit : found.refits)
      if (refit.effect == names[n] && refit.finished) {
        tell(options, "interval of " + refit.effect);
        settle(subject.fitted, found.sources, found.numerical ? &*found.numerical : nullptr, options.tolerances,
               found.metric, refit);
      }
}

double beyond_freedom(const Score& score, double statistic) { return statistic - 2 * score.freedom; }

}  // namespace

std::vector<std::string> worth_refitting(const ScoreTable& table, const Tolerances& tolerances, std::size_t poses,
                                         std::size_t count) {
  double best = 0;
  for (const Score& score : table.scores) best = std::max(best, beyond_freedom(score, score.statistic));
  std::vector<std::pair<double, std::string>> ranked;
  for (const Score& score : table.scores)
    if (beyond_freedom(score, score.statistic) > std::max(least_worth, worth_share * best))
      ranked.emplace_back(
          beyond_freedom(score, statistic_without(score, shared_tolerance_for(score.effect, {}, tolerances, poses))),
          score.effect);
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> effects;
  for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) effects.push_back(ranked[i].second);
  return effects;
}

RefitProblem refit_problem(const Subject& subject, const Findings& found,
                           const std::function<void(const std::string&)>& progress) {
  return {subject.fitted, subject.whole, &subject.model,
          &found.model,   &found.base,   &found.metric,
          &found.sources, &found.others, std::log(found.whitening.effective_points()),
          progress};
}

std::unique_ptr<Findings> examine(const Subject& subject, const ExamineOptions& options) {
  auto found = std::make_unique<Findings>();
  found->tolerances = options.tolerances;
  calibration::Evaluator evaluator(subject.fitted, subject.model, accurate_enough());
  fit_base(subject, evaluator, options, *found);
  const RefitProblem problem = refit_problem(subject, *found, options.progress);
  tell(options, "effects at their usual size");
  find_secants(problem, found->candidates);
  tell(options, "scores");
  found->table =
      score_candidates(found->base.solution.residuals, found->sources.mean_mm, found->base.solution.linearisation.slope,
                       found->candidates, found->whitening, options.seed);
  judge_base(subject, *found);
  const bool quiet = is_quiet(*found, options.rules);
  judge_by_other_poses(subject, options, !quiet || options.correct_quiet_poses, *found);
  if (!quiet && options.refits > 0)
    found->refits =
        refit_candidates(problem, found->candidates, found->table,
                         worth_refitting(found->table, options.tolerances, subject.fitted.measurements.size(),
                                         static_cast<std::size_t>(options.refits)));
  for (const Refit& refit : found->refits)
    found->left.push_back(refit.solved ? lack_of_fit(refit.fit, found->metric) : LackOfFit{});
  found->budget = error_budget(found->base, found->sources, found->metric);
  found->diagnosis = decide(found->table, found->refits, found->left, found->figures, options.rules);
  settle_named(subject, options, *found);
  if (found->diagnosis.verdict == Verdict::unexplained) {
    tell(options, "map of missing forces");
    found->forces = force_map(subject.fitted, found->model, found->base, found->metric, options.seed);
  }
  return found;
}

}  // namespace supine::diagnosis
