// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/laws/invariant_response.h"

namespace supine::simulation {

/// μ/2 (I1 - 3 - 2L) + λ/2 L² (Bonet and Wood 2008, eq. 6.27); with stiffening b, I1 - 3 becomes (e^{b (I1 - 3)} - 1)/b
/// (Fung 1967; Demiray 1972).
struct NeoHookean : InvariantLaw {
  /// @pre margin() > 0
  template <class T>
  static InvariantResponse<T> response(const InvariantStrain& s, const BulkMaterial<T>& m) {
    InvariantResponse<T> w;
    add_shear(s, m, w);
    add_log_volume_energy(m.lambda_kpa, s.log_j, w);
    return w;
  }

 private:
  template <class T>
  static void add_shear(const InvariantStrain& s, const BulkMaterial<T>& m, InvariantResponse<T>& w) {
    using std::exp, std::expm1;
    const T half = 0.5 * m.mu_kpa;
    const double excess = s.i1 - 3;
    w.wl -= m.mu_kpa;
    if (m.stiffening == T(0.0)) {
      w.energy += half * (excess - 2 * s.log_j);
      // ∂/∂b at b = 0 of (e^{bx} - 1)/b and of its derivative e^{bx}: x²/2 and x, carried by b itself when T has a
      // slope.
      w.energy += half * m.stiffening * (0.5 * excess * excess);
      w.w1 += half * (1.0 + m.stiffening * excess);
      return;
    }
    const T growth = exp(m.stiffening * excess);
    w.energy += half * (expm1(m.stiffening * excess) / m.stiffening - 2 * s.log_j);
    w.w1 += half * growth;
    w.w11 += half * m.stiffening * growth;
  }
};

}  // namespace supine::simulation
