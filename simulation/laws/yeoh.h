// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/laws/invariant_response.h"

namespace supine::simulation {

/// C1 K + C2 K² + C3 K³ + λ/2 L², C1 = μ/2 (Yeoh 1993, with K for I1 - 3).
struct Yeoh : InvariantLaw {
  /// @pre margin() > 0
  template <class T>
  static InvariantResponse<T> response(const InvariantStrain& s, const BulkMaterial<T>& m) {
    InvariantResponse<T> w;
    const T half = 0.5 * m.mu_kpa;
    const double k = distortion(s);
    const T &r2 = m.shape[0], &r3 = m.shape[1];
    add_distortion_energy(T(half * k * (1.0 + k * (r2 + k * r3))), T(half * (1.0 + k * (2.0 * r2 + 3.0 * k * r3))),
                          T(half * (2.0 * r2 + 6.0 * k * r3)), w);
    add_log_volume_energy(m.lambda_kpa, s.log_j, w);
    return w;
  }
};

}  // namespace supine::simulation
