// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/skin_stiffening.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& SkinStiffening::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "exponent",
                                               .unit = "1",
                                               .lower = 0,
                                               .upper = 6,
                                               .median = 1,
                                               .spread = 0.7,
                                               .one_sided = true,
                                               .meaning = "b of the exponential law"}};
  return rows;
}

void SkinStiffening::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                           Fields<Dual>& fields) const {
  const Dual& exponent = values[0];
  for (Dual& b : fields.skin_stiffening) b += exponent;
}

}  // namespace supine::simulation
