// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/chest_wall_motion.h"

#include "meshing/anatomy.h"
#include "simulation/effects/bump.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& ChestWallMotion::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "amplitude_mm",
                                               .unit = "mm",
                                               .lower = -15,
                                               .upper = 15,
                                               .median = 0,
                                               .spread = 5,
                                               .meaning = "how far the muscle has come out in the middle of the hill"},
                                              {.name = "centre_lateral",
                                               .unit = "1",
                                               .lower = -0.4,
                                               .upper = 0.4,
                                               .median = 0,
                                               .spread = 0.15,
                                               .meaning = "the hill's middle from the foot's, in foot radii",
                                               .shape = true},
                                              {.name = "centre_head",
                                               .unit = "1",
                                               .lower = -0.4,
                                               .upper = 0.4,
                                               .median = 0,
                                               .spread = 0.15,
                                               .meaning = "the same toward the head",
                                               .shape = true},
                                              {.name = "radius",
                                               .unit = "1",
                                               .null = 1,
                                               .lower = 0.7,
                                               .upper = 1.4,
                                               .median = 1,
                                               .spread = 0.15,
                                               .meaning = "where the hill ends, in foot radii",
                                               .shape = true}};
  return rows;
}

void ChestWallMotion::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                            Fields<Dual>& fields) const {
  if (scene.is_imaged() || scene.anatomy.is_object()) return;
  const Dual &amplitude_mm = values[0], &centre_lateral = values[1], &centre_head = values[2], &radius = values[3];
  const Table& q = scene.layout.interface.q;
  for (Eigen::Index p = 0; p < q.rows(); ++p)
    fields.muscle_offset[p] += amplitude_mm * bump(q.row(p).transpose(), centre_lateral, centre_head, radius);
}

}  // namespace supine::simulation
