// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

namespace supine::simulation {

using Matrix3 = Eigen::Matrix3d;

/// Elastic constants of one cell.
template <class T>
struct BulkMaterial {
  T mu_kpa;      ///< E / (2 (1 + ν))
  T lambda_kpa;  ///< E ν / ((1 + ν)(1 - 2ν))
  T stiffening;  ///< b of μ/2 (e^{b(I1-3)} - 1)/b; 0 = none; neo_hookean only
  /// Of the law: mooney_rivlin {share of C01, -}, yeoh {C2/C1, C3/C1}, gent {limit of K, -}; unread by the others.
  std::array<T, 2> shape{};
};

template <class T>
BulkMaterial<T> bulk_material(const T& young_kpa, const T& poisson, const T& stiffening) {
  return {young_kpa / (2.0 * (1.0 + poisson)), young_kpa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
          stiffening};
}

}  // namespace supine::simulation
