// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/simulation/effects/effect_scene.h"

#include "segmentation/tissue.h"
#include "simulation/parameters.h"

namespace supine::testing {

simulation::EffectSetting effect(const std::string& name, const std::map<std::string, double>& values) {
  simulation::EffectSetting setting = simulation::null_setting(*simulation::find_effect(name));
  for (const auto& [key, value] : values) setting.parameters.at(key).value = value;
  return setting;
}

TestScene mixed_box(int n) {
  TestScene scene = box_scene(n, {60, 60, 30});
  scene.mesh.fraction.setZero(scene.mesh.cells.rows(), segmentation::tissue_count);
  scene.mesh.fraction.col(static_cast<int>(segmentation::Tissue::adipose)).setConstant(0.5);
  scene.mesh.fraction.col(static_cast<int>(segmentation::Tissue::gland)).setConstant(0.4);
  scene.mesh.fraction.col(static_cast<int>(segmentation::Tissue::tumour)).setConstant(0.1);
  return scene;
}

void part(TestScene& scene) {
  const meshing::Anatomy one = scene.anatomy;
  const double middle = scene.mesh.points.col(0).mean();
  scene.anatomy.side = "both";
  scene.anatomy.breasts = {one, one};
  scene.anatomy.breast = (scene.mesh.points.col(0).array() < middle).cast<int>();
}

}  // namespace supine::testing
