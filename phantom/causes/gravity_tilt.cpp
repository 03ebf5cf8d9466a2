// SPDX-License-Identifier: AGPL-3.0-or-later
#include <Eigen/Geometry>

#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose == "prone") return;
  const Eigen::Vector3d g = fields.gravity;
  fields.gravity = Eigen::AngleAxisd(cause.values.at("roll_rad"), Eigen::Vector3d::UnitZ()) *
                   (Eigen::AngleAxisd(cause.values.at("pitch_rad"), Eigen::Vector3d::UnitX()) * g);
}

const bool known = add_cause_kind(
    {.name = "gravity_tilt",
     .draws = {{"roll_rad", Draw::How::direction, 0.08, 0.25}, {"pitch_rad", Draw::How::direction, 0.08, 0.25}},
     .apply = apply,
     .nuisance = {{"roll_rad", "gravity_roll_rad"}, {"pitch_rad", "gravity_pitch_rad"}}});

}  // namespace
}  // namespace supine::phantom
