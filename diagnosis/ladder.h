// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// How well one fitted model does.
struct RungFigures {
  std::string added;  ///< effect added last; empty for the base model
  double mae_mm, rms_mm, held_out_rms_mm;
};

/// A model on the ladder, fitted with all that is never known, beside what could have been done instead.
struct Rung : RungFigures {
  double probability = 1;   ///< of the effect that was added, before it was
  double p_value = 1;       ///< of the best effect that could still be added
  Unexplained unexplained;  ///< by this model and any effect that could be added
  Unexplained left;         ///< by this model alone
  /// Controls of a rung that added something: nothing added and everything free fitted again (the rung before); and an
  /// effect drawn by the seed from all others that this model could have, fitted. Its effect is empty where none had an
  /// equilibrium.
  std::optional<RungFigures> refit_only, random_other;
  simulation::Model model;  ///< as fitted, without nuisances
};

struct Ladder {
  std::vector<Rung> rungs;                     ///< the first is the base model, everything free fitted again
  std::string stopped;                         ///< why
  Verdict verdict = Verdict::nothing_missing;  ///< of the first rung
  std::vector<std::string> missing;            ///< of the first rung
  Diagnosis last;                              ///< of the last rung
  double noise_floor_mm = 0;                   ///< what noise and mesh alone would leave
  simulation::Model model;                     ///< of the last rung
};

/// Adds the likeliest of what is missing, fits again, examines again, as long as an effect is missing, or until @p most
/// were added. Where several do as well (ambiguous) a choice would be a guess: the ladder stops.
/// @param first  examination of the subject's model
Ladder climb(const Subject& subject, const ExamineOptions& options, const Findings& first, int most = 3);

}  // namespace supine::diagnosis
