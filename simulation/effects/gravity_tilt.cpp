// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/gravity_tilt.h"

#include <numbers>

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& GravityTilt::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "roll_rad",
                                               .unit = "rad",
                                               .lower = -0.6,
                                               .upper = 0.6,
                                               .median = 0,
                                               .spread = 10 * std::numbers::pi / 180,
                                               .meaning = "rotation about the head axis (+z LPS)"},
                                              {.name = "pitch_rad",
                                               .unit = "rad",
                                               .lower = -0.6,
                                               .upper = 0.6,
                                               .median = 0,
                                               .spread = 10 * std::numbers::pi / 180,
                                               .meaning = "rotation about the left axis (+x LPS)"}};
  return rows;
}

void GravityTilt::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                        Fields<Dual>& fields) const {
  if (scene.is_imaged()) return;
  const Dual &roll_rad = values[0], &pitch_rad = values[1];
  const Dual cr = ceres::cos(roll_rad), sr = ceres::sin(roll_rad), cp = ceres::cos(pitch_rad),
             sp = ceres::sin(pitch_rad);
  const auto g = fields.gravity;
  const Eigen::Matrix<Dual, 3, 1> pitched(g[0], cp * g[1] - sp * g[2], sp * g[1] + cp * g[2]);
  fields.gravity << cr * pitched.x() - sr * pitched.y(), sr * pitched.x() + cr * pitched.y(), pitched.z();
}

}  // namespace supine::simulation
