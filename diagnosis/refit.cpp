// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/refit.h"

#include <algorithm>
#include <cmath>

#include "calibration/held_out.h"
#include "common/error.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using simulation::Parameter;

double rms(const Eigen::VectorXd& d) { return std::sqrt(d.squaredNorm() / static_cast<double>(d.size())); }

/// Strength is what changes the model at its typical size; an effect without such a row is all strength.
bool is_strength(const simulation::Effect& effect, const Parameter& row) {
  const auto& rows = effect.parameters();
  const bool any = std::any_of(rows.begin(), rows.end(), [](const Parameter& r) { return r.median != r.null; });
  return !any || row.median != row.null;
}

double one_step(const std::string& parameter, const Score& score, const Candidate& candidate) {
  for (std::size_t k = 0; k < candidate.parameters.size(); ++k)
    if (candidate.parameters[k].name == parameter) return score.step[static_cast<Eigen::Index>(k)];
  return 0;
}

Refit refitted(calibration::Evaluator& evaluator, const simulation::Model& model,
               const calibration::FitOptions& options, const std::string& effect) {
  Refit result;
  result.effect = effect;
  const calibration::FreeParameters parameters(model);
  try {
    const calibration::Fit fit = calibration::fit_least_squares(evaluator, parameters, options);
    Eigen::VectorXd priors = Eigen::VectorXd::Zero(parameters.size());
    for (Eigen::Index i = 0; options.use_priors && i < priors.size(); ++i)
      if (const auto& prior = parameters.priors()[static_cast<std::size_t>(i)]) priors[i] = 1 / (prior->sd * prior->sd);
    result.solved = true;
    result.parameters = parameters.names();
    result.values = parameters.values(fit.u);
    result.rms_mm = rms(fit.residuals.distance_mm);
    result.held_out_rms_mm = rms(calibration::held_out_distances(fit.residuals, fit.linearisation.slope, priors,
                                                                 calibration::spatial_blocks(fit.residuals)));
    result.evaluations = fit.evaluations;
  } catch (const NumericalFailure&) {
    // No equilibrium from the typical size: not a candidate that can be judged.
  }
  return result;
}

}  // namespace

simulation::EffectSetting typical_setting(const std::string& name, const Score& score, const Candidate& candidate) {
  const simulation::Effect& effect = *simulation::find_effect(name);
  simulation::EffectSetting setting = simulation::null_setting(effect);
  for (const Parameter& row : effect.parameters()) {
    if (!is_strength(effect, row)) {
      setting.parameters[row.name].value = row.median;
      continue;
    }
    const double step = one_step(simulation::parameter_name(effect, row), score, candidate);
    const double value = row.median != row.null ? row.median : std::clamp(step, row.lower, row.upper);
    const double sd = row.one_sided ? row.median * std::expm1(row.log_sd) : row.log_sd;
    setting.parameters[row.name] = {value, true, sd, row.lower, row.upper};
  }
  return setting;
}

std::vector<Refit> refit_candidates(calibration::Evaluator& evaluator, const simulation::Model& model,
                                    const calibration::FitOptions& options, const calibration::Fit& base,
                                    const std::vector<Candidate>& candidates, const ScoreTable& table,
                                    const std::vector<std::string>& which) {
  calibration::FitOptions near_base = options;
  near_base.near = &base.prediction.solution;
  std::vector<Refit> refits;
  for (const std::string& effect : which) {
    const auto score = std::find_if(table.scores.begin(), table.scores.end(),
                                    [&effect](const Score& s) { return s.effect == effect; });
    const auto candidate = std::find_if(candidates.begin(), candidates.end(),
                                        [&effect](const Candidate& c) { return c.effect == effect; });
    if (score == table.scores.end() || candidate == candidates.end()) continue;
    simulation::Model with = model;
    with.effects.push_back(typical_setting(effect, *score, *candidate));
    refits.push_back(refitted(evaluator, with, near_base, effect));
  }
  return refits;
}

std::vector<std::string> worth_refitting(const ScoreTable& table, const ScoreTable& white, std::size_t count) {
  std::vector<std::string> effects;
  for (const ScoreTable* t : {&table, &white}) {
    std::size_t taken = 0;
    for (const Score& score : t->scores) {
      if (taken == count) break;
      if (score.wrong_sign) continue;
      ++taken;
      if (std::find(effects.begin(), effects.end(), score.effect) == effects.end()) effects.push_back(score.effect);
    }
  }
  return effects;
}

}  // namespace supine::diagnosis
