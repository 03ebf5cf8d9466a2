// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>

namespace supine::phantom {

/// Size and stiffness of a breast that moves as far as volunteers' do.
struct Volunteer {
  double nipple_moves_mm;            ///< from prone to supine
  double foot_radius_mm, height_mm;  ///< of the stress-free body
  double breast_kpa, skin_kpa;       ///< Young's moduli, to be scaled together until the nipple moves as far
};

/// Moduli that are believed of a breast and its skin, kPa.
inline constexpr double softest_breast_kpa = 0.2, stiffest_breast_kpa = 1, softest_skin_kpa = 5, stiffest_skin_kpa = 40;

/// Draws one; the distribution stands in docs/supine-phantom.md.
Volunteer draw_volunteer(std::uint64_t seed);

}  // namespace supine::phantom
