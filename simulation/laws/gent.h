// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/laws/invariant_response.h"

namespace supine::simulation {

/// -μ/2 Jm ln(1 - K/Jm) + λ/2 L² (Gent 1996, with K for I1 - 3): no energy beyond its pole, K = Jm.
struct Gent : InvariantLaw {
  static double margin(const InvariantStrain& s, const BulkMaterial<double>& m) {
    return 1 - distortion(s) / m.shape[0];
  }

  /// @pre margin() > 0
  template <class T>
  static InvariantResponse<T> response(const InvariantStrain& s, const BulkMaterial<T>& m) {
    using std::log;
    InvariantResponse<T> w;
    const T half = 0.5 * m.mu_kpa;
    const T& limit = m.shape[0];
    const double k = distortion(s);
    const T room = 1.0 - k / limit;
    add_distortion_energy(T(-half * limit * log(room)), T(half / room), T(half / (limit * room * room)), w);
    add_log_volume_energy(m.lambda_kpa, s.log_j, w);
    return w;
  }
};

}  // namespace supine::simulation
