// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>

namespace supine::phantom {

/// Size and stiffness of a breast that moves as far as volunteers' do.
struct Volunteer {
  double foot_radius_mm, height_mm;  ///< of the stress-free body
  double breast_kpa, skin_kpa;       ///< Young's moduli
};

/// Draws one; the distribution stands in docs/supine-phantom.md.
Volunteer draw_volunteer(std::uint64_t seed);

}  // namespace supine::phantom
