// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace supine::simulation {

/// A smooth hill over anatomy coordinates: (1 - r²)³ with r = |q - centre|/radius, 0 from r = 1 on. Twice continuously
/// differentiable, 1 in the middle.
inline double bump(const Eigen::Vector2d& q, const Eigen::Vector2d& centre, double radius) {
  const double rest = 1 - (q - centre).squaredNorm() / (radius * radius);
  return rest > 0 ? rest * rest * rest : 0;
}

}  // namespace supine::simulation
