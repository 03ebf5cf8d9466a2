// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/effects/support_compliance.h"

#include <numbers>

#include "meshing/supports.h"
#include "simulation/effects/named_row.h"
#include "simulation/fields.h"
#include "simulation/model_fields.h"

namespace supine::simulation {
namespace {

constexpr double rad_per_mn_mm = std::numbers::pi / 180 * 1e-6;  // of 1 degree per N m

/// Two springs in line.
void soften(Dual& stiffness, const Dual& compliance) { stiffness /= 1.0 + stiffness * compliance; }

}  // namespace

const std::vector<Parameter>& SupportCompliance::parameters() const {
  static const std::vector<Parameter> rows = {{.name = "turn_deg_per_nm",
                                               .unit = "deg/(N m)",
                                               .lower = 0,
                                               .upper = 1000,
                                               .median = 30,
                                               .spread = 1,
                                               .one_sided = true,
                                               .meaning = "turn under a moment about an axis in the support's plane"},
                                              {.name = "across",
                                               .unit = "1",
                                               .null = 1,
                                               .lower = 0,
                                               .upper = 100,
                                               .median = 1,
                                               .spread = 0.5,
                                               .meaning = "softness across the normal over that along it",
                                               .shape = true}};
  return rows;
}

const std::vector<OptionRow>& SupportCompliance::options() const {
  static const std::vector<OptionRow> rows = {
      {"support",
       "all",
       {},
       "name of the support; all = every one that does not slide, each by its own force and moment"}};
  return rows;
}

bool SupportCompliance::belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy&, const Model& model) const {
  for (int s = 0; s < static_cast<int>(mesh.support_names.size()); ++s)
    if (is_tied(kind_of_support(model, mesh, s), mesh)) return true;
  return false;
}

void SupportCompliance::apply(const Scene& scene, std::span<const Dual> values,
                              const std::map<std::string, std::string>& options, Fields<Dual>& fields) const {
  const std::vector<std::string>& names = scene.mesh.support_names;
  if (names.empty()) return;
  const std::string& wanted = options.at("support");
  const int named = wanted == "all" ? -1 : *named_row(names, wanted, name(), "support");
  if (named >= 0 && !scene.tied_supports[named])
    throw InputError(
        fmt::format("effect '{}': support = \"{}\" slides, and only a fixed or elastic support gives way; say its kind "
                    "in [supports.{}], or soften it by its normal_kpa_per_mm and tangential_kpa_per_mm",
                    name(), wanted, wanted));
  const Eigen::VectorXi of_face = meshing::support_of_faces(scene.mesh);
  const std::vector<int>& begin = scene.layout.support_begin;
  const Eigen::Index points = fields.interface_normal.size() / begin.back();
  for (int s = 0; s < static_cast<int>(names.size()); ++s) {
    if (!scene.tied_supports[s] || (named >= 0 && s != named)) continue;
    const auto area = meshing::support_area(scene.mesh, of_face, s);
    const Dual along = rad_per_mn_mm * area.bending_mm4 * values[0];
    for (Eigen::Index p = points * begin[s]; p < points * begin[s + 1]; ++p) {
      soften(fields.interface_normal[p], along);
      soften(fields.interface_tangential[p], along * values[1]);
    }
  }
}

}  // namespace supine::simulation
