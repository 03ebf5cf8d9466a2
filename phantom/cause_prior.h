// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "phantom/causes/cause.h"

namespace supine::phantom {

/// Probability of no cause, one, two, three; shared evenly by the sets of that many.
inline constexpr double prior_of_sets[] = {0.5, 0.3, 0.15, 0.05};

/// Causes of the catalogue, as many and as large as their priors say, cut at the catalogue's ranges, and acting as the
/// catalogue has them (Cause::by_catalogue).
std::vector<Cause> draw_causes_from_prior(std::uint64_t seed);

/// One of them. @throws InputError  the catalogue has no such effect
Cause draw_cause_from_prior(const std::string& name, std::uint64_t seed);

}  // namespace supine::phantom
