// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/arm_traction.h"

#include "meshing/anatomy.h"
#include "simulation/effects/bump.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& ArmTraction::parameters() const {
  static const std::vector<Parameter> rows = {
      {"lateral_kpa", "kPa", 0, -0.6, 0.6, 0, 0.15, false,
       "traction toward the patient's outer side, middle of the patch"},
      {"head_kpa", "kPa", 0, -0.6, 0.6, 0, 0.15, false, "traction toward the head, middle of the patch"},
      {"centre_lateral", "1", 0.65, 0, 1.3, 0.65, 0.15, false, "the patch's middle from the foot's, in foot radii",
       true},
      {"centre_head", "1", 0.65, 0, 1.3, 0.65, 0.15, false, "the same toward the head", true},
      {"radius", "1", 0.5, 0.3, 1, 0.5, 0.15, false, "where the patch ends, in foot radii", true}};
  return rows;
}

void ArmTraction::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                        Fields<Dual>& fields) const {
  if (scene.pose == "prone") return;
  const FaceGroup& skin = scene.layout.skin;
  for (Eigen::Index f = 0; f < skin.faces.size(); ++f) {
    const Dual weight = bump(skin.q.row(f).transpose(), values[2], values[3], values[4]);
    if (weight.a == 0) continue;
    const meshing::Anatomy& breast = scene.anatomy.breast_frame(skin.breast[f]);
    for (int i = 0; i < 3; ++i)
      fields.skin_traction[3 * f + i] += weight * (values[0] * breast.lateral[i] + values[1] * breast.head[i]);
  }
}

}  // namespace supine::simulation
