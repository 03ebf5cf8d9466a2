// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/evidence/hypotheses.h"

namespace supine::diagnosis {

enum class Verdict { nothing_missing, missing, ambiguous, unexplained };
/// nothing_missing, missing, ambiguous, unexplained.
std::string verdict_name(Verdict verdict);

/// What no effect explains, RMS over the fitted points, mm.
struct Unexplained {
  double mean_mm = 0, low_mm = 0, high_mm = 0;  ///< and its 95 % interval
};

/// How likely an effect is, over all hypotheses.
struct Inclusion {
  std::string effect;
  double probability = 0;
  double bayes_factor = 1;   ///< odds of the probability over those of the prior
  double left_out_gain = 0;  ///< ln density of what was left out, with it less without; 0 where it was not asked for
  std::string ends_at = {};  ///< a number of it that ended at an end of its range, in the likeliest set that holds it
};

struct Diagnosis {
  Verdict verdict = Verdict::nothing_missing;
  std::vector<std::string> missing;  ///< all that is; the whole set when ambiguous; the best when unexplained
  std::vector<std::string>
      ambiguous_rest;  ///< under missing: rivals for one more; of a local cause: what may be beside
  std::string why;     ///< one sentence
};

/// The most probable first.
std::vector<Inclusion> inclusions(const std::vector<Hypothesis>& hypotheses, const std::vector<std::string>& effects,
                                  const Priors& priors);

/// The first line that holds:
///   missing          some effect has a probability of priors.named_at or more, and what was left out does not speak
///                    against it by 3 or more, and none of its numbers ended at an end of its range
///   unexplained      an effect would be missing but for such a number: so large, steep or narrow it is something else
///   unexplained      a local cause that no effect lists has priors.named_at or more (unlisted.h)
///   unexplained      a local cause has a Bayes factor of 3 or more and is likelier than all effects together, and
///                    "nothing" has less than 0.5
///   ambiguous        "nothing" has less than 0.5 and some Bayes factor is 3 or more or an expected effect is likelier
///                    than nothing, or "nothing" has less than 0.25, or an expected effect is neither found nor
///                    excluded and cannot be seen; expected effects that are neither are named with the others
///   unexplained      the lower end of what is unexplained is above priors.unexplained_bound_mm
///   nothing_missing  otherwise
/// "Nothing" is neither an effect nor such a cause.
/// @param included  of these hypotheses, most probable first
/// @param unseen    effects that the scan could not show if they were there (not_seen() of the score test)
Diagnosis decide(const std::vector<Hypothesis>& hypotheses, const std::vector<std::string>& effects,
                 const std::vector<Inclusion>& included, const Unexplained& unexplained, const Priors& priors,
                 const std::vector<std::string>& unseen);

}  // namespace supine::diagnosis
