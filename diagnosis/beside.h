// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// What would be named by itself, the surest effect of it, where more than it is likelier than not: then errors that
/// were measured without it judge what is beside it. Together with what they were measured beside before. Empty where
/// there is no such effect, or where nothing more is likely than what they were measured beside.
std::vector<int> surest_part(const Findings& found);

/// ln of the odds that a set holds a part, every set under the errors it is weighed under.
/// @pre  some sets hold it and some do not
double ln_odds_of(const std::vector<Hypothesis>& hypotheses, const std::vector<int>& part);

/// Gives what is weighed under the last errors the weight with which these odds are what they were before: errors
/// beside a part judge what is beside it, not the part itself. A mesh that errs more beside it would speak against it,
/// or for it, by its size alone.
void keep_odds(Findings& found);

}  // namespace supine::diagnosis
