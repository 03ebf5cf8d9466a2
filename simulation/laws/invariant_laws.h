// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/laws/gent.h"
#include "simulation/laws/invariant_law_list.h"
#include "simulation/laws/mooney_rivlin.h"
#include "simulation/laws/neo_hookean.h"
#include "simulation/laws/neo_hookean_calculix.h"
#include "simulation/laws/yeoh.h"
#include "simulation/model.h"

namespace supine::simulation {

/// Whether a law is one of the list; the others have a rotation (rotation_laws.h).
constexpr bool is_invariant_law(BulkLaw law) { return law != BulkLaw::corotational && law != BulkLaw::corotational_qr; }

/// Calls @p use with the law's struct. @pre is_invariant_law(law)
template <class Use>
auto with_invariant_law(BulkLaw law, const Use& use) {
  switch (law) {
#define SUPINE_CASE(name, Law) \
  case BulkLaw::name:          \
    return use(Law());
    SUPINE_INVARIANT_LAWS(SUPINE_CASE)
#undef SUPINE_CASE
    default:
      return use(NeoHookean());
  }
}

inline double law_margin(BulkLaw law, const InvariantStrain& s, const BulkMaterial<double>& m) {
  return with_invariant_law(law, [&](auto chosen) { return decltype(chosen)::margin(s, m); });
}

/// @pre law_margin() > 0
template <class T>
InvariantResponse<T> invariant_response(BulkLaw law, const InvariantStrain& s, const BulkMaterial<T>& m) {
  return with_invariant_law(law, [&](auto chosen) { return decltype(chosen)::response(s, m); });
}

inline VolumeStrain volume_strain(BulkLaw law, double ratio) {
  return with_invariant_law(law, [&](auto chosen) { return decltype(chosen)::volume_strain(ratio); });
}

}  // namespace supine::simulation
