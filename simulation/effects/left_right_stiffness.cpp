// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/left_right_stiffness.h"

#include "meshing/anatomy.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& LeftRightStiffness::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "log_ratio",
                                               .unit = "1",
                                               .lower = -2,
                                               .upper = 2,
                                               .median = 0,
                                               .spread = 0.3,
                                               .meaning = "ln of the left breast's stiffness over the right one's"}};
  return rows;
}

bool LeftRightStiffness::belongs_to(const meshing::TetMesh&, const meshing::Anatomy& anatomy, const Model&) const {
  return !anatomy.breasts.empty();
}

void LeftRightStiffness::apply(const Scene& scene, std::span<const Dual> values,
                               const std::map<std::string, std::string>&, Fields<Dual>& fields) const {
  if (scene.anatomy.breasts.empty()) return;
  const Dual& log_ratio = values[0];
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c)
    fields.ln_young[c] += log_ratio * (scene.layout.cell_breast[c] == 0 ? 0.5 : -0.5);
}

}  // namespace supine::simulation
