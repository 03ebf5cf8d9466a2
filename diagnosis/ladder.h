// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// A model on the ladder, fitted under all errors.
struct Rung {
  std::string added;  ///< effect added last; empty for the base model
  double mae_mm, rms_mm, held_out_rms_mm;
  std::vector<double> held_out_pose_rms_mm;
  double p_value;  ///< of the best effect that could still be added
};

struct Ladder {
  std::vector<Rung> rungs;  ///< the first is the control "refit only": the base model, everything free fitted again
  /// The control "a random other effect": one of the refits of the first rung that was not chosen, drawn by the seed;
  /// empty effect where there was none.
  Rung random_other;
  std::string stopped;                         ///< why
  Verdict verdict = Verdict::nothing_missing;  ///< of the first rung
  std::vector<std::string> missing;            ///< of the first rung
  double noise_floor_mm = 0;                   ///< what noise and mesh alone would leave
  simulation::Model model;                     ///< of the last rung
};

/// Adds what is missing, fits again, examines again, until nothing is missing, several do as well (then the best by
/// score would be a guess: the ladder stops), or @p most effects were added.
/// @param first  examination of the subject's model
Ladder climb(const Subject& subject, const ExamineOptions& options, const Findings& first, int most = 3);

}  // namespace supine::diagnosis
