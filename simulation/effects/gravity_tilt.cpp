// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/gravity_tilt.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& GravityTilt::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "roll_rad",
                                               .unit = "rad",
                                               .lower = -0.6,
                                               .upper = 0.6,
                                               .median = 0,
                                               .spread = 0.15,
                                               .meaning = "rotation about the head axis (+z LPS)"},
                                              {.name = "pitch_rad",
                                               .unit = "rad",
                                               .lower = -0.6,
                                               .upper = 0.6,
                                               .median = 0,
                                               .spread = 0.15,
                                               .meaning = "rotation about the left axis (+x LPS)"}};
  return rows;
}

void GravityTilt::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                        Fields<Dual>& fields) const {
  if (scene.pose == "prone") return;
  const Dual cr = ceres::cos(values[0]), sr = ceres::sin(values[0]), cp = ceres::cos(values[1]),
             sp = ceres::sin(values[1]);
  const auto g = fields.gravity;
  const Eigen::Matrix<Dual, 3, 1> pitched(g[0], cp * g[1] - sp * g[2], sp * g[1] + cp * g[2]);
  fields.gravity << cr * pitched.x() - sr * pitched.y(), sr * pitched.x() + cr * pitched.y(), pitched.z();
}

}  // namespace supine::simulation
