// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "calibration/least_squares.h"
#include "diagnosis/evidence/priors.h"

namespace supine::diagnosis {

/// What nuisances (nuisances.h) do to the distances of a fit that takes them to be at their null: one standard
/// deviation each, independent of each other.
struct NeverKnown {
  std::vector<std::string> sources;  ///< per column: Nuisance::source
  Eigen::MatrixXd shapes_mm;         ///< #R by #sources, change of the distances
};

/// @param model  of the fit, at its answer
/// @throws NumericalFailure  no sensitivities there
NeverKnown never_known_at(calibration::Evaluator& evaluator, const simulation::Model& model,
                          const calibration::Fit& fit, const Priors& priors);

/// Where an error comes from, for a reader: "registration" is "where the scan lies".
std::string words_of_source(const std::string& source);

}  // namespace supine::diagnosis
