// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/fibre_anisotropy.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& FibreAnisotropy::parameters() const {
  static const std::vector<Parameter> rows = {
      {"stiffness_kpa", "kPa", 0, 0, 6, 0.6, 0.8, true, "k_f of k_f/4 (I4 - 1)^2 along the muscle's outward normal"}};
  return rows;
}

void FibreAnisotropy::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                            Fields<Dual>& fields) const {
  for (Dual& k : fields.fibre_modulus) k += values[0];
}

}  // namespace supine::simulation
