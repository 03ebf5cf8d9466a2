// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "simulation/laws/element_sums.h"
#include "simulation/laws/material.h"

namespace supine::simulation {

/// ∂P_iJ/∂F_kL at row 3i+J, column 3k+L, kPa.
using Tangent9 = Eigen::Matrix<double, 9, 9>;

/// The directions B = e_J, J = 1 to 3, in place of an element's shape gradients: with unit weight a law's sums are then
/// its stress and tangent.
inline const Nodal<3> unit_gradients = Nodal<3>::Identity();

/// @param sums  of one point over unit_gradients with unit weight   @param symmetric  only i <= k was summed
inline Tangent9 point_tangent(const ElementSums<3>& sums, bool symmetric) {
  Tangent9 tangent;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      const bool mirrored = symmetric && k < i;
      const Matrix3& part = sums.tangent[mirrored ? 3 * k + i : 3 * i + k];
      tangent.block<3, 3>(3 * i, 3 * k) = mirrored ? Matrix3(part.transpose()) : part;
    }
  return tangent;
}

/// Adds what the tangent of one point lacks to be positive semi-definite: |λ| u ⊗ u for every negative eigenvalue λ of
/// ∂P/∂F, u_a = M B_a with its mode M (Teran, Sifakis, Irving and Fedkiw 2005, section 6).
/// @param tangent   kPa, symmetric
/// @param gradient  ∂N_a/∂X of the point, 1/mm   @param volume  its weight, mm³
/// @param sums      of the element, mN/mm; its upper components i <= k are added to, as by a symmetric law
template <int N>
void take_off_negative_curvature(const Tangent9& tangent, const Nodal<N>& gradient, double volume,
                                 ElementSums<N>& sums) {
  if (Eigen::LLT<Tangent9>(tangent).info() == Eigen::Success) return;
  const Eigen::SelfAdjointEigenSolver<Tangent9> eigen(tangent);
  for (int m = 0; m < 9 && eigen.eigenvalues()[m] < 0; ++m) {
    const Eigen::Map<const Matrix3> transposed_mode(eigen.eigenvectors().col(m).data());  // row J, column i
    const Nodal<N> u = gradient * transposed_mode;
    sums.add_outer(u, u, -volume * eigen.eigenvalues()[m], true);
  }
}

}  // namespace supine::simulation
