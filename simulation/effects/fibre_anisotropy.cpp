// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/fibre_anisotropy.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& FibreAnisotropy::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "stiffness_kpa",
                                               .unit = "kPa",
                                               .lower = 0,
                                               .upper = 6,
                                               .median = 0.6,
                                               .spread = 0.8,
                                               .one_sided = true,
                                               .meaning = "k_f of k_f/4 (I4 - 1)^2 along the muscle's outward normal"}};
  return rows;
}

void FibreAnisotropy::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                            Fields<Dual>& fields) const {
  const Dual& stiffness_kpa = values[0];
  for (Dual& k : fields.fibre_modulus) k += stiffness_kpa;
}

}  // namespace supine::simulation
