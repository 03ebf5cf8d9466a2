// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "diagnosis/error_sources.h"
#include "diagnosis/other_poses.h"
#include "diagnosis/score_test.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {

/// A parameter of a refit, with its 95 % interval under Σ, cut at its range.
struct FittedParameter {
  std::string name, unit;
  double value, low, high;
};

/// A candidate added to the model and everything free fitted again, nonlinearly.
struct Refit {
  std::string effect;
  bool solved = false;     ///< whether the chain found an equilibrium with it; nothing below holds otherwise
  bool finished = false;   ///< whether it was followed to the end, or given up early as hopeless
  bool at_border = false;  ///< whether a place or width ended at the border of its range: a cause of another kind
  int freedom = 0;         ///< parameters of the effect that the score tests: its strength
  double gain = 0;         ///< fall of F from the base model's
  double bic = 0;          ///< gain − freedom · ln n − ln(det prior / det covariance) of its place and shape
  double rms_mm = 0, held_out_rms_mm = 0;   ///< fitted points; every block of skin without itself
  std::vector<double> pose_rms_mm;          ///< of every pose that was not fitted, then of each fitted one left out
  std::vector<double> pose_change_mm;       ///< rms of what the effect changes there
  double pose_gain = 0;                     ///< fall of the objective of poses that were not fitted (other_poses.h)
  double pose_misfit = 1;                   ///< what is left of it, per point
  std::vector<FittedParameter> parameters;  ///< of the effect
  simulation::Model model;                  ///< with the fitted numbers
  simulation::Model given;                  ///< as it began: where its priors stand
  WeightedFit fit;
};

/// Whether scans that were not fitted say anything of the refit: there are some with points over the skin, and what was
/// added is not that a scan lies elsewhere, which says nothing of where another lies.
bool unfitted_scans_judge(const Refit& refit, std::size_t unfitted_poses);

/// The effect with its strength free and without a prior, because how large it usually is shall not decide whether it
/// is there; its place and shape free with the catalogue's spread, because nobody knows them.
simulation::EffectSetting free_setting(const std::string& effect);

/// What all refits start from.
struct RefitProblem {
  calibration::MeasuredScene scene;  ///< fitted poses
  calibration::MeasuredScene whole;  ///< and those that were not, after them
  const simulation::Model* given;    ///< the base model as it was given: where its priors stand
  const simulation::Model* model;    ///< at its optimum
  const WeightedFit* base;
  const Metric* metric;
  const ErrorSources* sources;                       ///< of the metric
  const OtherPoses* others;                          ///< of the base model
  double log_points;                                 ///< ln n of the BIC
  std::function<void(const std::string&)> progress;  ///< may be empty; called by any thread, one at a time
};

/// Refits candidates side by side, each without the tolerance for itself, and compares them under all errors: from the
/// catalogue's usual size and from its one-step size, whichever starts better; three steps for all, to the end for
/// those whose F comes within reach of the best.
std::vector<Refit> refit_candidates(const RefitProblem& problem, const std::vector<Candidate>& candidates,
                                    const ScoreTable& table, const std::vector<std::string>& which);

/// Intervals of the effect's parameters from the information under Σ and the priors, 1.96 standard deviations times
/// √max(1, misfit) to each side, cut at the range.
std::vector<FittedParameter> linear_intervals(const std::string& effect, const WeightedFit& fit,
                                              const calibration::FreeParameters& parameters, const Metric& metric);

}  // namespace supine::diagnosis
