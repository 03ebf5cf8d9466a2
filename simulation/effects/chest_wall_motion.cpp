// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/chest_wall_motion.h"

#include "simulation/effects/bump.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& ChestWallMotion::parameters() const {
  static const std::vector<Parameter> rows = {
      {"amplitude_mm", "mm", 0, -15, 15, 0, 5, false, "how far the muscle has come out in the middle of the hill"},
      {"centre_lateral", "1", 0, -0.4, 0.4, 0, 0.15, false, "the hill's middle from the foot's, in foot radii", true},
      {"centre_head", "1", 0, -0.4, 0.4, 0, 0.15, false, "the same toward the head", true},
      {"radius", "1", 1, 0.7, 1.4, 1, 0.15, false, "where the hill ends, in foot radii", true}};
  return rows;
}

void ChestWallMotion::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                            Fields<Dual>& fields) const {
  if (scene.pose == "prone") return;
  const Table& q = scene.layout.interface.q;
  for (Eigen::Index p = 0; p < q.rows(); ++p)
    fields.muscle_offset[p] += values[0] * bump(q.row(p).transpose(), values[1], values[2], values[3]);
}

}  // namespace supine::simulation
