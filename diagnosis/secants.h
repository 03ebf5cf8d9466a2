// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "diagnosis/refit.h"

namespace supine::diagnosis {

/// Fills Candidate::secant of every candidate of one parameter whose usual size is not its null: one solve each at that
/// size, everything else as in the base model. What acts far from linearly (ligament, adhesion) shows itself there
/// where the slope at the null points elsewhere. Left empty where there is no equilibrium at that size.
void find_secants(const RefitProblem& problem, std::vector<Candidate>& candidates);

}  // namespace supine::diagnosis
