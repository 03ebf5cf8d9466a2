// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/laws/invariant_response.h"

namespace supine::simulation {

/// μ/2 (J^{-2/3} I1 - 3) + κ/2 (J - 1)², κ = λ + 2μ/3 (CalculiX *HYPERELASTIC, NEO HOOKE with C10 = μ/2, D1 = 2/κ).
struct NeoHookeanCalculix : InvariantLaw {
  /// (Ĵ - 1)²/2.
  static VolumeStrain volume_strain(double ratio) { return {ratio - 1, 1, 0}; }

  /// @pre margin() > 0
  template <class T>
  static InvariantResponse<T> response(const InvariantStrain& s, const BulkMaterial<T>& m) {
    InvariantResponse<T> w;
    const double share = std::exp(-2.0 / 3 * s.log_j), bar = share * s.i1;  // J^{-2/3}, Ī1
    const T half = 0.5 * m.mu_kpa, bulk = m.lambda_kpa + (2.0 / 3) * m.mu_kpa;
    w.energy += half * (bar - 3) + 0.5 * (s.j - 1) * (s.j - 1) * bulk;
    w.w1 += half * share;
    w.w1l += half * (-2.0 / 3 * share);
    w.wl += half * (-2.0 / 3 * bar) + bulk * (s.j * (s.j - 1));
    w.wll += half * (4.0 / 9 * bar) + bulk * (s.j * (2 * s.j - 1));
    return w;
  }
};

}  // namespace supine::simulation
