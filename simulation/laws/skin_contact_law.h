// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "common/curve.h"

namespace supine::simulation {

/// Energy per area of two skins a gap apart (negative: overlap), in kPa mm; its slope is minus the pressure between
/// them. None beyond the band; within it the pressure grows as a parabola up to stiffness × band / 2 where they touch,
/// and from there by the stiffness: twice continuously differentiable.
/// @param stiffness_kpa_per_mm, band_mm  > 0
inline Curve contact_energy(double gap_mm, double stiffness_kpa_per_mm, double band_mm) {
  const double k = stiffness_kpa_per_mm, b = band_mm, z = b - gap_mm;
  if (!(z > 0)) return {};
  if (z < b) return {k * z * z * z / (6 * b), -k * z * z / (2 * b), k * z / b};
  return {k * (b * b / 6 + 0.5 * z * (z - b)), -k * (z - 0.5 * b), k};
}

/// Weight of a place by its squared distance over that of the edge of its reach: (1 - t)³, 0 beyond.
inline Curve near_weight(double t) {
  if (!(t < 1)) return {};
  return {(1 - t) * (1 - t) * (1 - t), -3 * (1 - t) * (1 - t), 6 * (1 - t)};
}

/// Whether two skins face each other, by the cosine between their outward normals: 1 under -0.6, 0 over -0.2.
inline Curve facing_weight(double cosine) {
  constexpr double none = -0.2, width = 0.4;
  const Curve step = smooth_step((none - cosine) / width);
  return {step.value, -step.slope / width, step.curvature / (width * width)};
}

/// Share of the energy that counts, by the weight of the skin opposite (about 1 inside it, a half at its border): falls
/// to 0 beyond the border, so that nothing jumps where a point slides past it.
inline Curve coverage(double weight) {
  constexpr double none = 0.2, width = 0.5;
  const Curve step = smooth_step((weight - none) / width);
  return {step.value, step.slope / width, step.curvature / (width * width)};
}

}  // namespace supine::simulation
