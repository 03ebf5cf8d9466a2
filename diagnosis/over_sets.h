// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "diagnosis/examine.h"

namespace supine::diagnosis {

/// What is known of the numbers of an effect, whichever of the sets that hold it is true: their posteriors in the
/// refits of these sets, mixed by the probability of each. A number that another effect of a set makes up for has an
/// interval as wide as both say, where the likeliest set alone would promise too much.
///
/// A posterior is taken as two halves of normals that meet at the fitted value and reach to the ends of its interval.
/// @return  medians and 95 % intervals of the mixture; empty where fewer than two refits hold the effect
std::vector<FittedParameter> over_sets(const Findings& found, const std::string& effect);

}  // namespace supine::diagnosis
