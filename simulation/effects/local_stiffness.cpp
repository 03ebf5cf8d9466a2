// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/local_stiffness.h"

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/effects/about_a_place.h"
#include "simulation/fields.h"

namespace supine::simulation {

const std::vector<Parameter>& LocalStiffness::parameters() const {
  static const std::vector<Parameter> rows = {
      {.name = "log_ratio",
       .unit = "1",
       .lower = -4,
       .upper = 4,
       .median = 0,
       .spread = 1,
       .meaning = "ln of how many times as stiff it is in the middle"},
      centre_anywhere("centre_lateral", "the middle from the foot's, in foot radii"),
      centre_anywhere("centre_head", "the same toward the head"),
      {.name = "height",
       .unit = "1",
       .null = 0.5,
       .lower = 0,
       .upper = 2,
       .median = 0.5,
       .spread = 0.3,
       .meaning = "of the middle over the muscle, in foot radii",
       .shape = true},
      {.name = "length",
       .unit = "1",
       .null = 0.3,
       .lower = 0.1,
       .upper = 1,
       .median = 0.3,
       .spread = 0.1,
       .meaning = "distance at which 61 % of it are left, in foot radii",
       .shape = true}};
  return rows;
}

const std::vector<OptionRow>& LocalStiffness::options() const {
  static const std::vector<OptionRow> rows = {{"of", "tissue", {"tissue", "skin"}, "what is stiffer there"}};
  return rows;
}

bool LocalStiffness::belongs_to(const meshing::TetMesh&, const meshing::Anatomy& anatomy, const Model&) const {
  return is_one_breast(anatomy);
}

Eigen::Vector3d anatomy_place(const Scene& scene, const Eigen::Ref<const Eigen::RowVectorXi>& nodes) {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (const int n : nodes) {
    const meshing::Anatomy& frame = scene.anatomy.breast_frame(scene.anatomy.breast_of(n));
    place.head<2>() += scene.anatomy.q.row(n).transpose();
    place.z() += scene.anatomy.thickness_mm[n] / frame.foot_radius_mm;
  }
  return place / static_cast<double>(nodes.size());
}

void LocalStiffness::apply(const Scene& scene, std::span<const Dual> values,
                           const std::map<std::string, std::string>& options, Fields<Dual>& fields) const {
  if (scene.anatomy.is_object()) return;
  const Dual &log_ratio = values[0], &length = values[4];
  const auto share = [&](const Eigen::Vector3d& at) {
    Dual squares(0.0);
    for (int i = 0; i < 3; ++i) squares += (at[i] - values[1 + i]) * (at[i] - values[1 + i]);
    return ceres::exp(-0.5 * squares / (length * length));
  };
  if (options.at("of") == "skin") {
    const Eigen::VectorXi& faces = scene.layout.skin.faces;
    for (Eigen::Index f = 0; f < faces.size(); ++f)
      fields.skin_modulus[f] *=
          ceres::exp(log_ratio * share(anatomy_place(scene, scene.mesh.faces.row(faces[f]).head(3))));
    return;
  }
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c)
    fields.ln_young[c] += log_ratio * share(anatomy_place(scene, scene.mesh.cells.row(c).head(4)));
}

}  // namespace supine::simulation
