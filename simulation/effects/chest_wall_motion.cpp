// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/chest_wall_motion.h"

#include "simulation/effects/bump.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& ChestWallMotion::parameters() const {
  static const std::vector<Parameter> rows = {
      {"amplitude_mm", "mm", 0, -15, 15, 0, 5, false, "how far the muscle has come out at the foot's centre"}};
  return rows;
}

void ChestWallMotion::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                            Fields<Dual>& fields) const {
  if (scene.pose == "prone") return;
  const Table& q = scene.layout.interface.q;
  for (Eigen::Index p = 0; p < q.rows(); ++p)
    fields.muscle_offset[p] += values[0] * bump(q.row(p).transpose(), Eigen::Vector2d::Zero(), 1.0);
}

}  // namespace supine::simulation
