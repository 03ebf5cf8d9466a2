// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// Follows the likeliest sets of effects through the chain, and what is simpler than the one that comes out first;
/// fills refits, and the probabilities of the hypotheses anew.
///
/// Where a refit ends far from what the lines of the base fit promise, as bends do that are as long as the body, sets
/// are found one effect at a time instead: every effect is followed by itself, and lines are drawn again from the
/// likeliest of these, and from each set that comes out first. A set that no new line was drawn to counts as its best
/// part.
void follow(const Subject& subject, const ExamineOptions& options, Findings& found);

}  // namespace supine::diagnosis
