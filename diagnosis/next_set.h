// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "diagnosis/evidence/hypotheses.h"

namespace supine::diagnosis {

/// Screened probability from which a set is followed through the chain.
inline constexpr double worth_refitting = 0.01;

/// Whether a set waits to be followed: it holds an effect, was not followed, and the chain is not known to have no
/// equilibrium there.
bool is_open(const Hypothesis& h);

/// The next hypothesis that should be followed through the chain, or nullptr.
/// @param hypotheses        most probable first
/// @param least_with_first  probability of one that holds more than the likeliest and all of it
const Hypothesis* next_to_refit(const std::vector<Hypothesis>& hypotheses, double least_with_first = worth_refitting);

/// The likeliest hypothesis less one effect, not followed yet; nullptr where there is none. Straight lines do the
/// simpler one wrong beside one that was followed.
const Hypothesis* simpler_than_first(const std::vector<Hypothesis>& hypotheses);

}  // namespace supine::diagnosis
