// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/local_muscle.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "meshing/anatomy.h"
#include "simulation/effects/about_a_place.h"
#include "simulation/effects/chest_wall_motion.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& LocalMuscle::parameters() const {
  static const std::vector<Parameter> rows = {
      {.name = "offset_mm",
       .unit = "mm",
       .lower = -15,
       .upper = 15,
       .median = 0,
       .spread = 5,
       .meaning = "how far the muscle has come out in the middle"},
      centre_anywhere("centre_lateral", "the middle from the foot's, in foot radii"),
      centre_anywhere("centre_head", "the same toward the head"),
      {.name = "length",
       .unit = "1",
       .null = 0.4,
       .lower = 0.1,
       .upper = 1,
       .median = 0.4,
       .spread = 0.15,
       .meaning = "distance at which 61 % of it are left, in foot radii",
       .shape = true}};
  return rows;
}

bool LocalMuscle::belongs_to(const meshing::TetMesh&, const meshing::Anatomy& anatomy, const Model&) const {
  return is_one_breast(anatomy);
}

bool LocalMuscle::is_listed(const Eigen::Vector2d& centre, double length) {
  const auto& rows = ChestWallMotion().parameters();
  const auto can_be = [&rows](const std::string& name, double value) {
    const auto row = std::find_if(rows.begin(), rows.end(), [&name](const Parameter& p) { return p.name == name; });
    return value >= row->lower && value <= row->upper;
  };
  const double half_width = length * std::sqrt(2 * std::numbers::ln2);
  const double half_width_of_bump = std::sqrt(1 - std::cbrt(0.5));  // (1 - r²)³ = ½
  return can_be("centre_lateral", centre.x()) && can_be("centre_head", centre.y()) &&
         can_be("radius", half_width / half_width_of_bump);
}

void LocalMuscle::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                        Fields<Dual>& fields) const {
  if (scene.is_imaged() || scene.anatomy.is_object()) return;
  const Dual &offset_mm = values[0], &centre_lateral = values[1], &centre_head = values[2], &length = values[3];
  const Table& q = scene.layout.interface.q;
  for (Eigen::Index p = 0; p < q.rows(); ++p) {
    const Dual lateral = q(p, 0) - centre_lateral, head = q(p, 1) - centre_head;
    fields.muscle_offset[p] += offset_mm * ceres::exp(-0.5 * (lateral * lateral + head * head) / (length * length));
  }
}

}  // namespace supine::simulation
