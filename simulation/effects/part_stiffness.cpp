// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/part_stiffness.h"

#include "meshing/tet_mesh.h"
#include "simulation/effects/named_row.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& PartStiffness::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "log_ratio",
                                               .unit = "1",
                                               .lower = -4,
                                               .upper = 4,
                                               .median = 0,
                                               .spread = 0.7,
                                               .meaning = "ln of the part's stiffness over that of the rest"}};
  return rows;
}

const std::vector<OptionRow>& PartStiffness::options() const {
  static const std::vector<OptionRow> rows = {{"part", "first", {}, "name of the part; first = the case's first"}};
  return rows;
}

bool PartStiffness::belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy&, const Model&) const {
  return !mesh.part_names.empty();
}

void PartStiffness::apply(const Scene& scene, std::span<const Dual> values,
                          const std::map<std::string, std::string>& options, Fields<Dual>& fields) const {
  const auto part = named_row(scene.mesh.part_names, options.at("part"), name(), "part");
  if (!part) return;
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c)
    fields.ln_young[c] += values[0] * scene.mesh.part_fraction(c, *part);
}

}  // namespace supine::simulation
