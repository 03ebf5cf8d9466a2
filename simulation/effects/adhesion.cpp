// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/adhesion.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& Adhesion::parameters() const {
  static const std::vector<Parameter> rows = {
      {"log_factor", "1", 0, -1.5, 5, 2, 1.5, false, "ln of the factor on the tangential interface stiffness"}};
  return rows;
}

void Adhesion::apply(const Scene&, std::span<const Dual> values, const std::map<std::string, std::string>&,
                     Fields<Dual>& fields) const {
  const Dual factor = ceres::exp(values[0]);
  for (Dual& k : fields.interface_tangential) k *= factor;
}

}  // namespace supine::simulation
