// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

namespace supine::segmentation {

/// Multi-level thresholds: the levels that part the values into classes of least variance within (N. Otsu 1979), found
/// exactly on a histogram of 512 equal bins by dynamic programming.
/// @param values  not all equal
/// @param classes  2 to 8
/// @return classes − 1 levels, ascending; a value belongs to the upper class when it is >= the level (to a bin's
/// rounding)
/// @throws InputError  for another number of classes, no values, or fewer distinct values than classes
std::vector<double> otsu_levels(std::span<const float> values, int classes);

}  // namespace supine::segmentation
