// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/stiffness_gradient.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& StiffnessGradient::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "lateral",
                                               .unit = "1",
                                               .lower = -1.5,
                                               .upper = 1.5,
                                               .median = 0,
                                               .spread = 0.5,
                                               .meaning = "change of ln E per foot radius toward the outer side"},
                                              {.name = "head",
                                               .unit = "1",
                                               .lower = -1.5,
                                               .upper = 1.5,
                                               .median = 0,
                                               .spread = 0.5,
                                               .meaning = "change of ln E per foot radius toward the head"}};
  return rows;
}

void StiffnessGradient::apply(const Scene& scene, std::span<const Dual> values,
                              const std::map<std::string, std::string>&, Fields<Dual>& fields) const {
  const Dual &lateral = values[0], &head = values[1];
  const Table& q = scene.layout.cell_q;
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c) fields.ln_young[c] += lateral * q(c, 0) + head * q(c, 1);
}

}  // namespace supine::simulation
