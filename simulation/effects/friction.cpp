// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/friction.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& Friction::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "coefficient",
                                               .unit = "1",
                                               .lower = 0,
                                               .upper = 0.6,
                                               .median = 0.2,
                                               .spread = 0.7,
                                               .one_sided = true,
                                               .meaning = "Coulomb's coefficient"}};
  return rows;
}

void Friction::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                     Fields<Dual>& fields) const {
  const Dual& coefficient = values[0];
  for (Dual& mu : fields.interface_friction) mu += coefficient;
}

}  // namespace supine::simulation
