// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace supine::simulation {

/// A smooth hill over anatomy coordinates: (1 - r²)³ with r = |q - centre|/radius, 0 from r = 1 on. Twice continuously
/// differentiable, 1 in the middle.
/// @tparam T  double, or a dual number for the derivatives with respect to place and radius
template <class T>
T bump(const Eigen::Vector2d& q, const T& centre_x, const T& centre_y, const T& radius) {
  const T x = q.x() - centre_x, y = q.y() - centre_y;
  const T rest = 1.0 - (x * x + y * y) / (radius * radius);
  return rest > T(0.0) ? rest * rest * rest : T(0.0);
}

}  // namespace supine::simulation
