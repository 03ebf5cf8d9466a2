// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/skin_prestretch.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& SkinPrestretch::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "excess",
                                               .unit = "1",
                                               .lower = -0.08,
                                               .upper = 0.4,
                                               .median = 0.1,
                                               .spread = 0.1,
                                               .meaning = "stretch of the skin in the undeformed shape, less 1"}};
  return rows;
}

void SkinPrestretch::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                           Fields<Dual>& fields) const {
  const Dual& excess = values[0];
  for (Dual& stretch : fields.skin_prestretch) stretch += excess;
}

}  // namespace supine::simulation
