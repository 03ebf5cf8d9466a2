// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/refit.h"
#include "diagnosis/score_test.h"

namespace supine::diagnosis {

enum class Verdict { nothing_missing, missing, ambiguous, unexplained };
/// nothing_missing, missing, ambiguous, unexplained.
std::string verdict_name(Verdict verdict);

/// The first answer, from linearised scores and, where they were made, refits.
struct FirstDiagnosis {
  Verdict verdict;
  std::vector<std::string> missing;  ///< one; the whole set when ambiguous, measurement effects first; best when
                                     ///< unexplained
  ScoreTable table;                  ///< under errors that neighbouring points share
  ScoreTable white;                  ///< under white noise: what a naive test would say
  std::vector<std::string> unseen;   ///< effects that move no fitted point
  std::vector<Refit> refits;         ///< of the candidates that were refitted
};

/// Bounds of the verdict (docs/supine-diagnose.md).
struct VerdictRules {
  double p_value = 0.05;         ///< of the best candidate, over the whole catalogue
  double held_out_share = 0.05;  ///< the held-out RMS must fall by this share
  double held_out_mm = 0.05;     ///< and by this much
  double bic = 6;                ///< without refits: candidates within this of the best cannot be told from it
  double rival_share = 0.03;     ///< with refits: those whose held-out RMS is within this share of the best
};

/// Names an effect only when its score could not come from any candidate by chance and the held-out error is predicted
/// to fall; names every candidate that does as well.
/// @param noise_mm  the scanner's, to say whether anything is left to explain
FirstDiagnosis decide(ScoreTable table, ScoreTable white, std::vector<std::string> unseen, double noise_mm,
                      const VerdictRules& rules = {});

/// The same with the errors of refits instead of predicted ones: of the refitted candidates, those whose held-out error
/// falls enough; the best, and all that come close to it. Its score must not be one that chance gives (p).
FirstDiagnosis decide(ScoreTable table, ScoreTable white, std::vector<std::string> unseen, std::vector<Refit> refits,
                      double noise_mm, const VerdictRules& rules = {});

}  // namespace supine::diagnosis
