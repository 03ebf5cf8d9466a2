// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/misregistration.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& Misregistration::parameters() const {
  static const std::vector<Parameter> rows = {
      {"shift_x_mm", "mm", 0, -25, 25, 0, 3, false, "scan given too far to the patient's left (+x LPS)"},
      {"shift_y_mm", "mm", 0, -25, 25, 0, 3, false, "scan given too far to the back (+y LPS)"},
      {"shift_z_mm", "mm", 0, -25, 25, 0, 3, false, "scan given too far to the head (+z LPS)"},
      {"turn_x_rad", "rad", 0, -0.3, 0.3, 0, 0.05, false, "scan given turned about +x, through its centroid"},
      {"turn_y_rad", "rad", 0, -0.3, 0.3, 0, 0.05, false, "scan given turned about +y, through its centroid"},
      {"turn_z_rad", "rad", 0, -0.3, 0.3, 0, 0.05, false, "scan given turned about +z, through its centroid"}};
  return rows;
}

void Misregistration::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                            Fields<Dual>& fields) const {
  if (scene.pose == "prone") return;
  for (int i = 0; i < 6; ++i) fields.scan_motion[i] += values[i];
}

}  // namespace supine::simulation
