// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// Follows the likeliest sets of effects through the chain, and what is simpler than the one that comes out first;
/// fills refits, and the probabilities of the hypotheses anew. A scan that lies far off is put in its place before
/// anything else: from where it is not, lines show what is not there.
///
/// Where a refit ends far from what the lines of the base fit promise, as bends do that are as long as the body, sets
/// are found one effect at a time instead: every effect is followed by itself, and lines are drawn again from the
/// likeliest of these, and from each set that comes out first. A set that no new line was drawn to counts as its best
/// part.
///
/// Errors of mesh and body are those of a model that lacks nothing. Where one effect is sure and more beside it is
/// likelier than not, or where it would not be if the scans counted for half (beside.h), they are measured anew beside
/// that effect, and whatever holds it is weighed under these: what a tied breast shows that an untied one does not must
/// not count for a second effect. With two that are sure again, for a third.
///
/// An effect may have stood for something that was found beside it since: then its strength ends where it does nothing,
/// yet no set without it was ever fitted as well. Its set is followed without it from where the whole ended, and all is
/// weighed under errors that were not measured beside it. What is simpler than the likeliest set, and nothing beside
/// the likeliest effect, are followed again from where that ended (parts_of_first.h).
void follow(const Subject& subject, const ExamineOptions& options, Findings& found);

}  // namespace supine::diagnosis
