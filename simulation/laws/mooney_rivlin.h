// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/laws/invariant_response.h"

namespace supine::simulation {

/// C10 (I1 - 3) + C01 (I2 - 3) - 2 (C10 + 2 C01) L + (λ - 4 C01)/2 L² (FEBio theory manual, coupled Mooney-Rivlin);
/// C01 = share μ/2, C10 = (1 - share) μ/2. I2 brings 4 C01 of its own to λ, which is taken off L².
struct MooneyRivlin : InvariantLaw {
  /// @pre margin() > 0
  template <class T>
  static InvariantResponse<T> response(const InvariantStrain& s, const BulkMaterial<T>& m) {
    InvariantResponse<T> w;
    const T half = 0.5 * m.mu_kpa, c01 = half * m.shape[0];
    add_distortion_energy(T((half - c01) * distortion(s)), T(half - c01), T(0.0), w);
    w.energy += c01 * (s.i2 - 3 - 4 * s.log_j);
    w.w2 += c01;
    w.wl -= 4.0 * c01;
    add_log_volume_energy(T(m.lambda_kpa - 4.0 * c01), s.log_j, w);
    return w;
  }
};

}  // namespace supine::simulation
