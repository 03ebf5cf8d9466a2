// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/adhesion.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& Adhesion::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "log_factor",
                                               .unit = "1",
                                               .lower = -1.5,
                                               .upper = 5,
                                               .median = 2,
                                               .spread = 1.5,
                                               .meaning = "ln of the factor on the tangential interface stiffness"}};
  return rows;
}

void Adhesion::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                     Fields<Dual>& fields) const {
  const Dual& log_factor = values[0];
  const Dual factor = ceres::exp(log_factor);
  for (Dual& k : fields.interface_tangential) k *= factor;
}

}  // namespace supine::simulation
