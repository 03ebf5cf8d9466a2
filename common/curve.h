// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace supine {

/// A function of one number with two derivatives.
struct Curve {
  double value = 0, slope = 0, curvature = 0;
};

/// From 0 at t <= 0 to 1 at t >= 1, twice continuously differentiable.
inline Curve smooth_step(double t) {
  if (!(t > 0)) return {};
  if (t >= 1) return {1, 0, 0};
  return {t * t * t * (10 + t * (6 * t - 15)), 30 * t * t * (1 - t) * (1 - t), 60 * t * (1 - t) * (1 - 2 * t)};
}

}  // namespace supine
