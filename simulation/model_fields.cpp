// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/model_fields.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/parameters.h"

namespace supine::simulation {
namespace {

/// Stiffness of the springs under each support: of the model's interface, of its own, or of what is fixed.
void set_supports(const Model& model, const Scene& scene, Fields<Dual>& fields) {
  if (scene.mesh.support_names.empty()) return;
  const std::vector<int>& begin = scene.layout.support_begin;
  const Eigen::Index points = fields.interface_normal.size() / std::max(1, begin.back());
  for (std::size_t s = 0; s + 1 < begin.size(); ++s) {
    const Eigen::Index first = points * begin[s], count = points * (begin[s + 1] - begin[s]);
    auto normal = fields.interface_normal.segment(first, count);
    auto tangential = fields.interface_tangential.segment(first, count);
    if (kind_of_support(model, scene.mesh, static_cast<int>(s)) == InterfaceKind::fixed) {
      normal.setConstant(Dual(fixed_support_kpa_per_mm));
      tangential.setConstant(Dual(fixed_support_kpa_per_mm));
    } else if (const auto own = model.supports.find(scene.mesh.support_names[s]); own != model.supports.end()) {
      if (own->second.normal_kpa_per_mm) normal.setConstant(Dual(*own->second.normal_kpa_per_mm));
      if (own->second.tangential_kpa_per_mm) tangential.setConstant(Dual(*own->second.tangential_kpa_per_mm));
    }
  }
}

Fields<Dual> base_fields(const Model& model, const Scene& scene, const Eigen::Vector3d& gravity,
                         const std::string& varied) {
  const Layout& layout = scene.layout;
  const Eigen::Index cells = layout.cell_q.rows(), skin = layout.skin.faces.size(), contact = layout.interface.q.rows();
  const auto number = [&model, &varied](const std::string& name) {
    Dual value(base_setting(model, name).value);
    if (varied == name) value.v[0] = 1;
    return value;
  };
  const auto constant = [](Eigen::Index size, const Dual& value) {
    return Fields<Dual>::Column::Constant(size, value).eval();
  };
  Fields<Dual> fields;
  fields.ln_young = constant(cells, ceres::log(number("breast.young_modulus_kpa")));
  fields.poisson = constant(cells, number("breast.poisson_ratio"));
  fields.law_shape_1 = fields.law_shape_2 = constant(cells, Dual(0.0));
  for (const BaseParameter& row : base_parameters())
    if (row.bulk_law == model.breast.law)
      (row.law_shape == 1 ? fields.law_shape_1 : fields.law_shape_2) = constant(cells, number(row.name));
  fields.density = constant(cells, number("breast.density_kg_m3") * 1e-9);  // kg/m³ → kg/mm³
  fields.skin_modulus = constant(skin, number("skin.young_modulus_kpa") * number("skin.thickness_mm"));
  fields.skin_poisson = constant(skin, number("skin.poisson_ratio"));
  fields.skin_compression = constant(skin, number("skin.compression_share"));
  fields.skin_prestretch = constant(skin, Dual(1.0));
  fields.interface_normal = constant(contact, number("interface.normal_kpa_per_mm"));
  fields.interface_tangential = constant(contact, number("interface.tangential_kpa_per_mm"));
  set_supports(model, scene, fields);
  fields.cut_stiffness = constant(layout.cut.q.rows(), number("cut.stiffness_kpa_per_mm"));
  fields.stiffening = fields.fibre_modulus = constant(cells, Dual(0.0));
  fields.skin_stiffening = constant(skin, Dual(0.0));
  // A plate's E h³/12(1 − ν²) over E h; the neo-Hookean skin is incompressible.
  const Dual thickness = number("skin.thickness_mm"),
             ratio = model.skin.law == SkinLaw::corotational ? number("skin.poisson_ratio") : Dual(0.5);
  fields.skin_bending =
      constant(skin, model.skin.bending_share * thickness * thickness / (12.0 * (1.0 - ratio * ratio)));
  fields.skin_traction = constant(3 * skin, Dual(0.0));
  fields.interface_friction = fields.muscle_offset = constant(contact, Dual(0.0));
  fields.imaged_offset = constant(3 * scene.mesh.points.rows(), Dual(0.0));
  fields.scan_motion = constant(6, Dual(0.0));
  fields.gravity = (gravity_mm_s2 * gravity).cast<Dual>();
  return fields;
}

void apply_effect(const Effect& effect, const EffectSetting& setting, const Scene& scene, const std::string& varied,
                  Fields<Dual>& fields) {
  std::vector<Dual> values;
  for (const Parameter& row : effect.parameters()) {
    const auto found = setting.parameters.find(row.name);
    values.emplace_back(found != setting.parameters.end() ? found->second.value : row.median);
    if (varied == parameter_name(effect, row)) values.back().v[0] = 1;
  }
  std::map<std::string, std::string> options;
  for (const OptionRow& row : effect.options()) options[row.name] = row.default_value;
  for (const auto& [name, value] : setting.options) options[name] = value;
  effect.apply(scene, values, options, fields);
}

/// The same effect with every parameter that stands at its null moved to an ordinary size.
EffectSetting with_typical_values(EffectSetting setting) {
  const Effect* effect = find_effect(setting.name);
  if (effect == nullptr) return setting;
  for (const Parameter& row : effect->parameters()) {
    auto& value = setting.parameters.try_emplace(row.name, Setting{row.median}).first->second.value;
    if (value == row.null) value = row.null + 0.25 * (row.upper - row.null);
  }
  return setting;
}

/// Names of the columns that the effect, alone and of ordinary size, changes in the imaged pose or in the scene's pose.
std::vector<std::string> changed_columns(const Model& model, const EffectSetting& setting, const Scene& scene) {
  Model alone = model, without = model;
  alone.effects = {with_typical_values(setting)};
  without.effects.clear();
  const Eigen::Vector3d gravity = Eigen::Vector3d(1, 2, 3).normalized();  // no rotation leaves it as it is
  std::vector<std::string> changed;
  for (const std::string& pose : {scene.anatomy.imaged_pose, scene.pose}) {
    const Scene place{scene.mesh, scene.anatomy, scene.layout, pose};
    const auto with = values_of(make_fields(alone, place, gravity));
    const auto base = values_of(make_fields(without, place, gravity));
    for (const auto& [name, column] : field_columns<double>)
      if (with.*column != base.*column) changed.push_back(name);
  }
  return changed;
}

/// Why no force of this model depends on a column, or nullptr where one does.
const char* why_unread(const Model& model, const Scene& scene, const std::string& column) {
  const auto is = [&column](std::initializer_list<const char*> names) {
    return std::find(names.begin(), names.end(), column) != names.end();
  };
  if (model.interface.kind == InterfaceKind::fixed && scene.mesh.support_names.empty() &&
      is({"interface_normal", "interface_tangential", "interface_friction", "muscle_offset"}))
    return "interface.kind = \"fixed\" holds the whole inner surface; use \"sliding\" or remove the effect";
  if (model.breast.law != BulkLaw::neo_hookean && is({"stiffening"}))
    return "it acts on breast.law = \"neo_hookean\" only (yeoh and gent stiffen by numbers of their own; "
           "mooney_rivlin, "
           "neo_hookean_calculix, corotational and corotational_qr do not); change the law or remove the effect";
  if (model.skin.young_modulus_kpa.value == 0 && is({"skin_prestretch", "skin_stiffening"}))
    return "skin.young_modulus_kpa = 0 leaves no skin; give it a modulus or remove the effect";
  if (model.skin.law != SkinLaw::neo_hookean && is({"skin_stiffening"}))
    return "it acts on skin.law = \"neo_hookean\" only; change the law or remove the effect";
  return nullptr;
}

}  // namespace

InterfaceKind kind_of_support(const Model& model, const meshing::TetMesh& mesh, int support) {
  if (mesh.support_names.empty()) return model.interface.kind;
  const auto own = model.supports.find(mesh.support_names[static_cast<std::size_t>(support)]);
  return own == model.supports.end() ? model.interface.kind : own->second.kind.value_or(model.interface.kind);
}

bool is_tied(InterfaceKind kind, const meshing::TetMesh& mesh) {
  return kind == InterfaceKind::elastic || (kind == InterfaceKind::fixed && !mesh.support_names.empty());
}

Fields<Dual> make_fields(const Model& model, const Scene& given, const Eigen::Vector3d& gravity,
                         const std::string& varied) {
  for (const EffectSetting& setting : model.effects)
    if (find_effect(setting.name) == nullptr)
      throw InputError(fmt::format("effect '{}' is not in the catalogue", setting.name));
  if (!varied.empty() && find_parameter(varied) == nullptr)
    throw InputError(fmt::format("there is no parameter '{}' in the base model or the catalogue", varied));
  Fields<Dual> fields = base_fields(model, given, gravity, varied);
  Scene scene = given;
  scene.tied_supports.clear();
  for (std::size_t s = 0; s < scene.mesh.support_names.size(); ++s)
    scene.tied_supports.push_back(is_tied(kind_of_support(model, scene.mesh, static_cast<int>(s)), scene.mesh));
  for (const Effect* effect : catalogue()) {
    bool present = false;
    for (const EffectSetting& setting : model.effects)
      if (setting.name == effect->name()) {
        apply_effect(*effect, setting, scene, varied, fields);
        present = true;
      }
    if (!present && varied.starts_with(effect->name() + "."))
      apply_effect(*effect, null_setting(*effect), scene, varied, fields);
  }
  if (const auto own = model.of_pose.find(scene.pose); own != model.of_pose.end())
    for (const EffectSetting& setting : own->second)
      apply_effect(*find_effect(setting.name), setting, scene, {}, fields);
  return fields;
}

void check_effects_act(const Model& model, const Scene& scene) {
  for (const EffectSetting& setting : model.effects) {
    const auto refuse = [&setting](const char* reason) {
      throw InputError(fmt::format("effect '{}' cannot change anything here: {}", setting.name, reason));
    };
    const Effect* effect = find_effect(setting.name);
    if (scene.is_imaged() && effect != nullptr && effect->traits().acts_in != ActsIn::every_pose)
      refuse(
          (scene.pose + " is the only pose and it acts between poses; give the case another one or remove the effect")
              .c_str());
    if (effect != nullptr && !effect->belongs_to(scene.mesh, scene.anatomy, model))
      refuse(
          "the body has not what it is about (a breast's anatomy, one breast by itself, two breasts, a named part, a "
          "named support that does not slide); remove the effect");
    const char* unread = nullptr;
    bool acts = false;
    for (const std::string& column : changed_columns(model, setting, scene)) {
      const char* reason = why_unread(model, scene, column);
      acts = acts || reason == nullptr;
      if (unread == nullptr) unread = reason;
    }
    if (acts) continue;
    refuse(unread != nullptr ? unread
                             : "the mesh has no tissue of its kind, or nothing lies where it acts (offset_mm, arc); "
                               "remove the effect");
  }
}

}  // namespace supine::simulation
