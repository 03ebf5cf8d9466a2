// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

#include "simulation/elements/assembly.h"

namespace supine::simulation {

/// A vector per node of an element; the three components are contiguous columns, so that node loops vectorise.
template <int N>
using Nodal = Eigen::Matrix<double, N, 3>;

/// Force and matrices of one element while its quadrature points are summed: entry (a, b) of tangent[3i + k] is
/// ∂r_ai/∂x_bk, of reference[3i + k] it is ∂r_ai/∂X_bk.
/// With a symmetric tangent only i <= k is summed, and write() fills in the rest.
template <int N>
struct ElementSums {
  using Square = Eigen::Matrix<double, N, N>;

  Nodal<N> force;
  std::array<Square, 9> tangent, reference;

  void clear(const Demand& demand) {
    force.setZero();
    if (demand.tangent)
      for (auto& m : tangent) m.setZero();
    if (demand.reference_tangent)
      for (auto& m : reference) m.setZero();
  }

  /// tangent += scale Σ_r u_a v_bᵀ in every component, or in those with i <= k.
  void add_outer(const Nodal<N>& u, const Nodal<N>& v, double scale, bool symmetric) {
    for (int i = 0; i < 3; ++i)
      for (int k = symmetric ? i : 0; k < 3; ++k)
        tangent[3 * i + k].noalias() += (scale * u.col(i)) * v.col(k).transpose();
  }
  void add_reference_outer(const Nodal<N>& u, const Nodal<N>& v, double scale) {
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) reference[3 * i + k].noalias() += (scale * u.col(i)) * v.col(k).transpose();
  }

  /// Into the buffers of add_elements(), whose matrices are zero.
  void write(const Demand& demand, bool symmetric, Local<N>& local) const {
    for (int a = 0; a < N; ++a) local.residual.template segment<3>(3 * a) = force.row(a).transpose();
    if (demand.tangent)
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          const bool mirrored = symmetric && k < i;
          const Square& m = tangent[mirrored ? 3 * k + i : 3 * i + k];
          for (int b = 0; b < N; ++b)
            for (int a = 0; a < N; ++a) local.tangent(3 * a + i, 3 * b + k) = mirrored ? m(b, a) : m(a, b);
        }
    if (demand.reference_tangent)
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
          for (int b = 0; b < N; ++b)
            for (int a = 0; a < N; ++a) local.reference_tangent(3 * a + i, 3 * b + k) = reference[3 * i + k](a, b);
  }
};

}  // namespace supine::simulation
