// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// What would be named by itself, the surest effect of it, where errors that were measured without it should not have
/// the last word: where more than it is likelier than not, because they judge what is beside it, and where, the first
/// of all, it would not be named if the scans counted for half (other_priors.h), because they judge itself; what is
/// beside it is judged under errors measured beside an effect already. Together with what errors were last measured
/// beside, where the likeliest set holds that. Empty where there is no such effect, or where they were measured beside
/// it.
std::vector<int> surest_part(const Findings& found);

/// ln of the odds that a set holds a part, every set under the errors it is weighed under.
/// @pre  some sets hold it and some do not
double ln_odds_of(const std::vector<Hypothesis>& hypotheses, const std::vector<int>& part);

/// Gives what is weighed under the last errors the weight with which these odds are what they were before: errors
/// beside a part judge what is beside it, not the part itself. A mesh that errs more beside it would speak against it,
/// or for it, by its size alone. Less only by what the part leads less where it and what lacks it are both fitted under
/// these errors (look_beside.h).
void keep_odds(Findings& found);

}  // namespace supine::diagnosis
