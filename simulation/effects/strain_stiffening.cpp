// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/strain_stiffening.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& StrainStiffening::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "exponent",
                                               .unit = "1",
                                               .lower = 0,
                                               .upper = 4,
                                               .median = 1,
                                               .spread = 0.7,
                                               .one_sided = true,
                                               .meaning = "b of the exponential law"}};
  return rows;
}

void StrainStiffening::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                             Fields<Dual>& fields) const {
  const Dual& exponent = values[0];
  for (Dual& b : fields.stiffening) b += exponent;
}

}  // namespace supine::simulation
