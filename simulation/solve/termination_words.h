// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "simulation/solve/equilibrium.h"

namespace supine::simulation {

/// Why Newton's method found no equilibrium, for the user.
/// @param residual_share  |r| over the weight |w|, where it ended
std::string termination_words(Termination end, int iterations, double residual_share);

}  // namespace supine::simulation
