// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "simulation/effect.h"

namespace supine::simulation {

/// A smooth hill over anatomy coordinates: (1 - r²)³ with r = |q - centre|/radius, 0 from r = 1 on. Twice continuously
/// differentiable, 1 in the middle. All in foot radii.
inline Dual bump(const Eigen::Vector2d& q, const Dual& centre_lateral, const Dual& centre_head, const Dual& radius) {
  const Dual lateral = q.x() - centre_lateral, head = q.y() - centre_head;
  const Dual rest = 1.0 - (lateral * lateral + head * head) / (radius * radius);
  return rest.a > 0 ? rest * rest * rest : Dual(0.0);
}

}  // namespace supine::simulation
