// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/tissue_stiffness.h"

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/fields.h"

namespace supine::simulation {

std::string TissueStiffness::meaning() const {
  return std::string(segmentation::tissue_names[static_cast<int>(tissue_)]) + " stiffer than the rest of the breast";
}

bool TissueStiffness::belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model&) const {
  return !anatomy.is_object() || (mesh.fraction.col(static_cast<int>(tissue_)).array() > 0).any();
}

void TissueStiffness::apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
                            Fields<Dual>& fields) const {
  const Dual& log_ratio = values[0];
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c)
    fields.ln_young[c] += log_ratio * scene.mesh.fraction(c, static_cast<int>(tissue_));
}

}  // namespace supine::simulation
