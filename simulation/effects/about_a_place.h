// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <utility>

#include "meshing/anatomy.h"
#include "simulation/parameter.h"

namespace supine::simulation {

/// Row of a coordinate along the muscle of the middle of what may be anywhere about a breast, in foot radii.
inline Parameter centre_anywhere(std::string name, std::string meaning) {
  return {.name = std::move(name),
          .unit = "1",
          .lower = -1.5,
          .upper = 1.5,
          .median = 0,
          .spread = 0.4,
          .meaning = std::move(meaning),
          .shape = true};
}

/// Whether the body is one breast: places about the foot of one are not those about the other's.
inline bool is_one_breast(const meshing::Anatomy& anatomy) { return !anatomy.is_object() && anatomy.breasts.empty(); }

}  // namespace supine::simulation
