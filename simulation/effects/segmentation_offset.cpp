// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/segmentation_offset.h"

#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& SegmentationOffset::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "offset_mm",
                                               .unit = "mm",
                                               .lower = -3,
                                               .upper = 3,
                                               .median = 0,
                                               .spread = 1.5,
                                               .meaning = "how far outside the imaged skin the true one lies"}};
  return rows;
}

void SegmentationOffset::apply(const Scene& scene, std::span<const Dual> values,
                               const std::map<std::string, std::string>&, Fields<Dual>& fields) const {
  const Dual& offset_mm = values[0];
  if (offset_mm.a == 0 && offset_mm.v[0] == 0) return;
  const Eigen::VectorXd& unit = scene.layout.unit_skin_offset(scene);
  for (Eigen::Index i = 0; i < unit.size(); ++i) fields.imaged_offset[i] += offset_mm * unit[i];
}

}  // namespace supine::simulation
