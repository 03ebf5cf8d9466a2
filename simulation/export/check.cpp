// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "simulation/export/exported_pose.h"
#include "simulation/laws/bulk_laws.h"
#include "simulation/model_fields.h"

namespace supine::simulation {
namespace {

struct Words {
  const char* name;
  std::vector<BulkLaw> bulk;
  std::vector<SkinLaw> skin;
  bool many_moduli;
};

// SOFA's corotational element takes a modulus per tetrahedron, its hyperelastic one a material per object.
Words words_of(Solver solver, BulkLaw law) {
  switch (solver) {
    case Solver::calculix:
      return {"CalculiX", {BulkLaw::neo_hookean_calculix}, {SkinLaw::neo_hookean}, true};
    case Solver::febio:
      return {"FEBio", {BulkLaw::neo_hookean}, {SkinLaw::neo_hookean}, true};
    case Solver::sofa:
      break;
  }
  return {"SOFA",
          {BulkLaw::corotational, BulkLaw::corotational_qr, BulkLaw::neo_hookean},
          {SkinLaw::neo_hookean, SkinLaw::corotational},
          law != BulkLaw::neo_hookean};
}

std::string names_of(const std::vector<BulkLaw>& laws) {
  std::string names;
  for (const BulkLaw law : laws) names += (names.empty() ? "\"" : " or \"") + name_of(law) + "\"";
  return names;
}

[[noreturn]] void refuse(const Words& words, const std::string& term, const std::string& change) {
  throw InputError(fmt::format("{} cannot express {}; {}", words.name, term, change));
}

void check_model(const Words& words, const Model& model) {
  if (std::find(words.bulk.begin(), words.bulk.end(), model.breast.law) == words.bulk.end())
    refuse(words, fmt::format("breast.law = \"{}\"", name_of(model.breast.law)), "use " + names_of(words.bulk));
  if (model.skin.young_modulus_kpa.value == 0) return;
  if (model.skin.compression == Compression::tension_field)
    refuse(words, "skin.compression = \"tension_field\" (a skin that wrinkles)",
           "use \"full\" and simulate with it, or leave the skin out (skin.young_modulus_kpa = 0)");
  if (std::find(words.skin.begin(), words.skin.end(), model.skin.law) == words.skin.end())
    refuse(words, "skin.law = \"corotational\"", "use \"neo_hookean\"");
}

using Column = Fields<double>::Column Fields<double>::*;

bool any(const Eigen::VectorXd& column, double null) { return (column.array() != null).any(); }

/// Names of the model's effects that by themselves take a column off @p null (not a number: make it vary).
std::string effects_behind(const Model& model, const Scene& scene, const Eigen::Vector3d& gravity, Column column,
                           double null) {
  std::string names;
  for (const EffectSetting& effect : model.effects) {
    Model alone = model;
    alone.effects = {effect};
    const auto fields = values_of(make_fields(alone, scene, gravity));
    const Eigen::VectorXd& values = fields.*column;
    if (any(values, std::isnan(null) ? values[0] : null)) names += (names.empty() ? "" : " ") + effect.name;
  }
  return names;
}

void check_fields(const Words& words, const Model& model, const Scene& scene, const Eigen::Vector3d& gravity) {
  const auto fields = values_of(make_fields(model, scene, gravity));
  const auto effect = [&](Column column, double null, const char* what) {
    const std::string names = effects_behind(model, scene, gravity, column, null);
    refuse(words, fmt::format("the effect {} ({})", names, what),
           fmt::format("take it out: supine-model remove {} model.toml", names));
  };
  if (any(fields.stiffening, 0)) effect(&Fields<double>::stiffening, 0, "exponential law of the tissue");
  if (any(fields.fibre_modulus, 0)) effect(&Fields<double>::fibre_modulus, 0, "fibres that carry tension only");
  if (any(fields.skin_prestretch, 1))
    effect(&Fields<double>::skin_prestretch, 1, "a membrane under tension in the undeformed shape");
  if (any(fields.skin_stiffening, 0)) effect(&Fields<double>::skin_stiffening, 0, "exponential law of the skin");
  if (model.interface.kind == InterfaceKind::sliding && any(fields.interface_friction, 0))
    effect(&Fields<double>::interface_friction, 0, "slip counted from the undeformed shape");
  if (!words.many_moduli && any(fields.ln_young, fields.ln_young[0]))
    refuse(words, fmt::format("a neo_hookean breast whose modulus varies (pose {})", scene.pose),
           "use breast.law = \"corotational\", or take out " +
               effects_behind(model, scene, gravity, &Fields<double>::ln_young, std::nan("")));
}

}  // namespace

void check_exportable(Solver solver, const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                      const std::vector<PoseLoad>& poses) {
  const Words words = words_of(solver, model.breast.law);
  if (mesh.order() != 1)
    refuse(words, "this mesh: quadratic cells are not written (each program places their points differently)",
           "make the mesh with supine-tetrahedralise --order 1 (make CASE=... ORDER=1)");
  if (!mesh.support_names.empty())
    refuse(words, "supports with names (springs along and across the normal)",
           "only a breast on its muscle is written");
  if (model.contact.kind != ContactKind::off)
    refuse(words, "[contact] (skin on smooth surfaces: skin or chest)", "leave the table out of the model");
  if (model.skin.fade_mm > 0)
    refuse(words, "skin.fade_mm (skin and cut that fade where the skin ends)", "leave the key out of the model");
  if (model.skin.bending_share > 0)
    refuse(words, "skin.bending_share (skin that resists bending)", "leave the key out of the model");
  check_model(words, model);
  const Layout layout = make_layout(mesh, anatomy);
  for (const PoseLoad& pose : poses) check_fields(words, model, {mesh, anatomy, layout, pose.name}, pose.gravity);
}

std::string export_extension(Solver solver) {
  return solver == Solver::calculix ? ".inp" : solver == Solver::febio ? ".feb" : ".scn";
}

}  // namespace supine::simulation
