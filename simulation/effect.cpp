// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effect.h"

#include "meshing/anatomy.h"

namespace supine::simulation {

bool Scene::is_imaged() const { return pose == anatomy.imaged_pose; }

const std::vector<OptionRow>& Effect::options() const {
  static const std::vector<OptionRow> none;
  return none;
}

bool Effect::belongs_to(const meshing::TetMesh&, const meshing::Anatomy& anatomy, const Model&) const {
  return !(traits().breast_only && anatomy.is_object());
}

}  // namespace supine::simulation
