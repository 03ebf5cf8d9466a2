// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/laws/element_sums.h"
#include "simulation/laws/invariant_laws.h"

namespace supine::simulation {

// With B_a = ∂N_a/∂X, f_a = F B_a, g_a = F^{-T} B_a = ∂N_a/∂x, D_ab = B_a·B_b, and b = F Fᵀ:
//   P B_a = 2 W1 f_a + W_L g_a + 2 W2 (I1 f_a - b f_a)
//   B_a·A·B_b = S_ab 1 - 2 W2 D_ab b + u_a g_bᵀ + h_a f_bᵀ - W_L g_b g_aᵀ - 2 W2 f_b f_aᵀ
//   S_ab = 2 W1 D_ab + 2 W2 (I1 D_ab - f_a·f_b),  u = W_LL g + 2 W_1L f,  h = (4 W11 + 4 W2) f + 2 W_1L g
// and from g_bᵀ F = B_bᵀ, f_bᵀ F = (C B_b)ᵀ the same summed products give ∂r/∂X.

/// Adds one quadrature point of weight @p volume: force, and the matrices that are demanded.
template <int N>
void add_invariant_point(const InvariantStrain& s, const InvariantResponse<double>& w, const Nodal<N>& gradient,
                         double volume, const Demand& demand, ElementSums<N>& sums) {
  using Square = Eigen::Matrix<double, N, N>;
  const Nodal<N>& b = gradient;
  const Nodal<N> f = b * s.f.transpose(), g = b * s.g.transpose();
  const bool second = w.w2 != 0, coupled = second || w.w11 != 0 || w.w1l != 0;

  Nodal<N> force = (2 * volume * w.w1) * f + (volume * w.wl) * g;  // V P B_a
  Nodal<N> bf;
  if (second) {
    bf = f * (s.f * s.f.transpose());
    force += (2 * volume * w.w2) * (s.i1 * f - bf);
  }
  sums.force += force;
  if (!demand.tangent && !demand.reference_tangent) return;

  Square spread = (2 * volume * w.w1) * b.lazyProduct(b.transpose());  // V S_ab
  Square gram;                                                         // 2 V W2 D_ab
  if (second) {
    gram = (2 * volume * w.w2) * b.lazyProduct(b.transpose());
    spread += s.i1 * gram - (2 * volume * w.w2) * f.lazyProduct(f.transpose());
  }
  Nodal<N> u = (volume * w.wll) * g, h;
  if (coupled) {
    u += (2 * volume * w.w1l) * f;
    h = (4 * volume * (w.w11 + w.w2)) * f + (2 * volume * w.w1l) * g;
  }
  const double pressure = volume * w.wl, mixed = 2 * volume * w.w2;
  if (demand.tangent) {
    for (int i = 0; i < 3; ++i)
      for (int k = i; k < 3; ++k) {
        Square& m = sums.tangent[3 * i + k];
        for (int n = 0; n < N; ++n) m.col(n) += u.col(i) * g(n, k) - g.col(k) * (pressure * g(n, i));
        if (i == k) m += spread;
        if (!coupled) continue;
        for (int n = 0; n < N; ++n) m.col(n) += h.col(i) * f(n, k) - f.col(k) * (mixed * f(n, i));
        if (second) m -= gram * s.f.row(i).dot(s.f.row(k));
      }
  }
  if (!demand.reference_tangent) return;
  // -(B_a·A·B_b) F + P B_a B_bᵀ - P B_b B_aᵀ
  const Nodal<N> left = force - u, right = force - pressure * g;
  Nodal<N> cb;
  Matrix3 bF;
  if (coupled) {
    cb = f * s.f;
    bF = s.f * (s.f.transpose() * s.f);
  }
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      Square& m = sums.reference[3 * i + k];
      const double turn = s.f(i, k);
      for (int n = 0; n < N; ++n) m.col(n) += left.col(i) * b(n, k) - b.col(k) * right(n, i) - spread.col(n) * turn;
      if (!coupled) continue;
      for (int n = 0; n < N; ++n) m.col(n) += cb.col(k) * (mixed * f(n, i)) - h.col(i) * cb(n, k);
      if (second) m += gram * bF(i, k);
    }
}

}  // namespace supine::simulation
