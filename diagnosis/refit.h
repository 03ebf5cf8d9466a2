// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "calibration/least_squares.h"
#include "diagnosis/score_test.h"

namespace supine::diagnosis {

/// A candidate added to the model and everything free fitted again, nonlinearly.
struct Refit {
  std::string effect;
  bool solved = false;  ///< whether the chain found an equilibrium with it; nothing below holds otherwise
  std::vector<std::string> parameters;
  Eigen::VectorXd values;
  double rms_mm = 0, held_out_rms_mm = 0;  ///< of the points that were fitted; every block of skin without itself
  int evaluations = 0;
};

/// The effect as supine-model add writes it: its strength free, from the catalogue's median (from the one-step size
/// where no sign is likelier), with the catalogue's spread and bounds; its place and shape fixed.
simulation::EffectSetting typical_setting(const std::string& effect, const Score& score, const Candidate& candidate);

/// Refits candidates one after the other, from the base fit.
/// @param which  effects to refit
std::vector<Refit> refit_candidates(calibration::Evaluator& evaluator, const simulation::Model& model,
                                    const calibration::FitOptions& options, const calibration::Fit& base,
                                    const std::vector<Candidate>& candidates, const ScoreTable& table,
                                    const std::vector<std::string>& which);

/// The first @p count effects of either table, without those of the wrong sign: correlated and white scores err in
/// different ways.
std::vector<std::string> worth_refitting(const ScoreTable& table, const ScoreTable& white, std::size_t count);

}  // namespace supine::diagnosis
