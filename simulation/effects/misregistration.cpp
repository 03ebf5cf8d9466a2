// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/misregistration.h"

#include <numbers>

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& Misregistration::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "shift_x_mm",
                                               .unit = "mm",
                                               .lower = -25,
                                               .upper = 25,
                                               .median = 0,
                                               .spread = 10,
                                               .meaning = "scan given too far to the patient's left (+x LPS)"},
                                              {.name = "shift_y_mm",
                                               .unit = "mm",
                                               .lower = -25,
                                               .upper = 25,
                                               .median = 0,
                                               .spread = 10,
                                               .meaning = "scan given too far to the back (+y LPS)"},
                                              {.name = "shift_z_mm",
                                               .unit = "mm",
                                               .lower = -25,
                                               .upper = 25,
                                               .median = 0,
                                               .spread = 10,
                                               .meaning = "scan given too far to the head (+z LPS)"},
                                              {.name = "turn_x_rad",
                                               .unit = "rad",
                                               .lower = -0.3,
                                               .upper = 0.3,
                                               .median = 0,
                                               .spread = 8 * std::numbers::pi / 180,
                                               .meaning = "scan given turned about +x, through its centroid"},
                                              {.name = "turn_y_rad",
                                               .unit = "rad",
                                               .lower = -0.3,
                                               .upper = 0.3,
                                               .median = 0,
                                               .spread = 8 * std::numbers::pi / 180,
                                               .meaning = "scan given turned about +y, through its centroid"},
                                              {.name = "turn_z_rad",
                                               .unit = "rad",
                                               .lower = -0.3,
                                               .upper = 0.3,
                                               .median = 0,
                                               .spread = 8 * std::numbers::pi / 180,
                                               .meaning = "scan given turned about +z, through its centroid"}};
  return rows;
}

void Misregistration::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                            Fields<Dual>& fields) const {
  if (scene.is_imaged()) return;
  // The rows stand in the order of scan_motion.
  for (int i = 0; i < 6; ++i) fields.scan_motion[i] += values[i];
}

}  // namespace supine::simulation
