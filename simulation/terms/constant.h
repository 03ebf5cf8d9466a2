// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <initializer_list>

#include "simulation/catalogue.h"

namespace supine::simulation {

/// Whether none of the numbers moves with the parameter that is being varied: most parameters touch few elements.
inline bool constant(std::initializer_list<Dual> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](const Dual& number) { return number.v[0] == 0; });
}

}  // namespace supine::simulation
