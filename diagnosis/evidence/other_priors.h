// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/diagnose.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/hypotheses.h"

namespace supine::diagnosis {

/// What would be said if something else had been believed, before or of the scans.
struct OtherPrior {
  /// "strengths half as wide", "… twice as wide", "the unexplained half as large", "… twice as large", "the scans
  /// counting for half"
  std::string what;
  Diagnosis diagnosis;
  std::vector<Inclusion> included;
  bool of_prior = true;  ///< else of the scans
};

/// The hypotheses weighed with half of the logarithm of what the scans say of each: with the square root of every Bayes
/// factor.
std::vector<Hypothesis> half_believed(std::vector<Hypothesis> hypotheses, const Priors& priors);

/// The verdict with the prior widths of all strengths, and with the scale of what is unexplained, halved and doubled.
/// Hypotheses are weighed again where they were linearised; those under a thousandth of the probability keep the
/// evidence they have. What was left out and what is unexplained count as they are.
///
/// Last half believed, as if the scans counted for half of what they say (Miller and
/// Dunson 2019, "Robust Bayesian inference via coarsening"): over cases with a known answer stated odds are twice as
/// far from the prior's, in the logarithm, as frequencies are (docs/hidden.md).
std::vector<OtherPrior> under_other_priors(const std::vector<Hypothesis>& hypotheses,
                                           const std::vector<std::string>& effects,
                                           const std::vector<Inclusion>& included, const Unexplained& unexplained,
                                           const Priors& priors, const std::vector<std::string>& unseen);

}  // namespace supine::diagnosis
