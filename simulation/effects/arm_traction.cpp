// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/arm_traction.h"

#include "meshing/anatomy.h"
#include "simulation/effects/bump.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& ArmTraction::parameters() const {
  static const std::vector<Parameter> rows = {
      {.name = "lateral_kpa",
       .unit = "kPa",
       .lower = -0.6,
       .upper = 0.6,
       .median = 0,
       .spread = 0.15,
       .meaning = "traction toward the patient's outer side, middle of the patch"},
      {.name = "head_kpa",
       .unit = "kPa",
       .lower = -0.6,
       .upper = 0.6,
       .median = 0,
       .spread = 0.15,
       .meaning = "traction toward the head, middle of the patch"},
      {.name = "centre_lateral",
       .unit = "1",
       .null = 0.65,
       .lower = 0,
       .upper = 1.3,
       .median = 0.65,
       .spread = 0.15,
       .meaning = "the patch's middle from the foot's, in foot radii",
       .shape = true},
      {.name = "centre_head",
       .unit = "1",
       .null = 0.65,
       .lower = 0,
       .upper = 1.3,
       .median = 0.65,
       .spread = 0.15,
       .meaning = "the same toward the head",
       .shape = true},
      {.name = "radius",
       .unit = "1",
       .null = 0.5,
       .lower = 0.3,
       .upper = 1,
       .median = 0.5,
       .spread = 0.15,
       .meaning = "where the patch ends, in foot radii",
       .shape = true}};
  return rows;
}

void ArmTraction::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                        Fields<Dual>& fields) const {
  if (scene.is_imaged() || scene.anatomy.is_object()) return;
  const Dual &lateral_kpa = values[0], &head_kpa = values[1], &centre_lateral = values[2], &centre_head = values[3],
             &radius = values[4];
  const FaceGroup& skin = scene.layout.skin;
  for (Eigen::Index f = 0; f < skin.faces.size(); ++f) {
    const Dual weight = bump(skin.q.row(f).transpose(), centre_lateral, centre_head, radius);
    if (weight.a == 0) continue;
    const meshing::Anatomy& breast = scene.anatomy.breast_frame(skin.breast[f]);
    for (int i = 0; i < 3; ++i)
      fields.skin_traction[3 * f + i] += weight * (lateral_kpa * breast.lateral[i] + head_kpa * breast.head[i]);
  }
}

}  // namespace supine::simulation
