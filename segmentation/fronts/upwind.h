// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace supine::segmentation {

/// What a voxel knows of the fronts that reached its neighbours, per axis: the difference along the axis is
/// sqrt(weight) (T - base) once the front has passed the neighbour at time `from`.
struct UpwindSides {
  std::array<float, 3> from;          ///< infinity where no front came
  std::array<float, 3> base, weight;  ///< 0 where no front came

  void forget() {
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = std::numeric_limits<float>::infinity();
      base[axis] = weight[axis] = 0;
    }
  }
  bool known(int axis) const { return from[axis] < std::numeric_limits<float>::infinity(); }
  /// (T - nearest) / h. @param inverse_squared  1 / h^2
  void set_first_order(int axis, float nearest, float inverse_squared) {
    from[axis] = base[axis] = nearest;
    weight[axis] = inverse_squared;
  }
  /// (3 T - 4 nearest + second) / (2 h). @pre second <= nearest
  void set_second_order(int axis, float nearest, float second, float inverse_squared) {
    from[axis] = nearest;
    base[axis] = nearest + (nearest - second) * (1.0f / 3);
    weight[axis] = 2.25f * inverse_squared;
  }
};

/// T of sum weight (T - base)^2 = slowness^2 over as many of the sides, earliest first, as T is not before.
/// @pre one side is known
inline float arrival_time(const UpwindSides& sides, float slowness) {
  std::array<float, 3> from = sides.from, base = sides.base, weight = sides.weight;
  const auto order = [&](int a, int b) {  // no branches: nothing foresees them
    const bool swap = from[a] > from[b];
    for (auto* value : {&from, &base, &weight}) {
      const float first = (*value)[a], second = (*value)[b];
      (*value)[a] = swap ? second : first;
      (*value)[b] = swap ? first : second;
    }
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  // Relative to the earliest side, so that late times lose no digits. Quadratics over one, two and three sides.
  const float start = from[0], square = slowness * slowness;
  const float base0 = base[0] - start, base1 = base[1] - start, base2 = base[2] - start;
  const float a1 = weight[0], b1 = a1 * base0, c1 = b1 * base0 - square;
  const float a2 = a1 + weight[1], b2 = b1 + weight[1] * base1, c2 = c1 + weight[1] * base1 * base1;
  const float a3 = a2 + weight[2], b3 = b2 + weight[2] * base2, c3 = c2 + weight[2] * base2 * base2;
  const float d2 = b2 * b2 - a2 * c2, d3 = b3 * b3 - a3 * c3;
  const float one = base0 + slowness / std::sqrt(a1);
  const float two = (b2 + std::sqrt(std::max(d2, 0.0f))) / a2, three = (b3 + std::sqrt(std::max(d3, 0.0f))) / a3;
  float time = one;
  time = d2 >= 0 && two >= from[1] - start ? two : time;
  time = d3 >= 0 && three >= from[2] - start ? three : time;
  return start + time;
}

}  // namespace supine::segmentation
