// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/fields.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/elements.h"
#include "simulation/surface_geometry.h"

namespace supine::simulation {
namespace {

using reconstruction::Region;

Eigen::VectorXi faces_of(const meshing::TetMesh& mesh, std::initializer_list<Region> regions) {
  std::vector<int> rows;
  for (int f = 0; f < mesh.faces.rows(); ++f)
    for (const Region region : regions)
      if (mesh.region[f] == static_cast<int>(region)) rows.push_back(f);
  return Eigen::Map<Eigen::VectorXi>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

template <class Face>
FaceGroup quadrature_group(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, Eigen::VectorXi faces) {
  constexpr int n = Face::nodes;
  FaceGroup group;
  group.q.resize(faces.size() * Face::points, 2);
  group.area_mm2.resize(faces.size() * Face::points);
  for (Eigen::Index f = 0; f < faces.size(); ++f) {
    const auto nodes = gather<n>(mesh.points, mesh.faces, faces[f]);
    for (int p = 0; p < Face::points; ++p) {
      const Eigen::Index row = f * Face::points + p;
      group.q.row(row).setZero();
      for (int a = 0; a < n; ++a)
        group.q.row(row) += Face::table().value[p][a] * anatomy.q.row(mesh.faces(faces[f], a));
      group.area_mm2[row] = face_point<Face>(nodes, p).area;
    }
  }
  group.faces = std::move(faces);
  return group;
}

template <class Face>
FaceGroup face_group(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, Eigen::VectorXi faces) {
  FaceGroup group;
  group.q.resize(faces.size(), 2);
  group.area_mm2.setZero(faces.size());
  for (Eigen::Index f = 0; f < faces.size(); ++f) {
    const auto corners = mesh.faces.row(faces[f]).head<3>();
    group.q.row(f) = (anatomy.q.row(corners[0]) + anatomy.q.row(corners[1]) + anatomy.q.row(corners[2])) / 3;
    const auto nodes = gather<Face::nodes>(mesh.points, mesh.faces, faces[f]);
    for (int p = 0; p < Face::points; ++p) group.area_mm2[f] += face_point<Face>(nodes, p).area;
  }
  group.faces = std::move(faces);
  return group;
}

template <class Face>
Layout layout_of(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy) {
  Layout layout;
  layout.skin = face_group<Face>(mesh, anatomy, faces_of(mesh, {Region::skin}));
  layout.interface = quadrature_group<Face>(mesh, anatomy, faces_of(mesh, {Region::inner, Region::ligament}));
  layout.cut = quadrature_group<Face>(mesh, anatomy, faces_of(mesh, {Region::cut}));
  layout.cell_q.resize(mesh.cells.rows(), 2);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    layout.cell_q.row(c).setZero();
    for (int a = 0; a < 4; ++a) layout.cell_q.row(c) += 0.25 * anatomy.q.row(mesh.cells(c, a));
  }
  return layout;
}

Fields<Dual> base_fields(const Model& model, const Layout& layout, const Eigen::Vector3d& gravity) {
  using Column = Fields<Dual>::Column;
  const auto constant = [](Eigen::Index size, double value) { return Column::Constant(size, Dual(value)).eval(); };
  const Eigen::Index cells = layout.cell_q.rows(), skin = layout.skin.faces.size();
  Fields<Dual> fields;
  fields.ln_young = constant(cells, std::log(model.breast.young_modulus_kpa.value));
  fields.poisson = constant(cells, model.breast.poisson_ratio.value);
  fields.stiffening = constant(cells, 0.0);
  fields.skin_modulus = constant(skin, model.skin.young_modulus_kpa.value * model.skin.thickness_mm.value);
  fields.skin_prestretch = constant(skin, 1.0);
  fields.interface_normal = constant(layout.interface.q.rows(), model.interface.normal_kpa_per_mm.value);
  fields.interface_tangential = constant(layout.interface.q.rows(), model.interface.tangential_kpa_per_mm.value);
  fields.cut_stiffness = constant(layout.cut.q.rows(), model.cut.stiffness_kpa_per_mm.value);
  for (int i = 0; i < 3; ++i) fields.gravity[i] = Dual(gravity_mm_s2 * gravity[i]);
  fields.density = Dual(model.breast.density_kg_m3.value * 1e-9);  // kg/m³ → kg/mm³
  return fields;
}

void apply_effect(const Effect& effect, const EffectSetting& setting, const Scene& scene, Fields<Dual>& fields) {
  std::vector<Dual> parameter_values;
  for (const Parameter& row : effect.parameters()) {
    const auto found = setting.parameters.find(row.name);
    parameter_values.emplace_back(found != setting.parameters.end() ? found->second.value : row.median);
  }
  std::map<std::string, std::string> options;
  for (const OptionRow& row : effect.options()) options[row.name] = row.default_value;
  for (const auto& [name, value] : setting.options) options[name] = value;
  effect.apply(scene, parameter_values, options, fields);
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

Eigen::VectorXd values(const Fields<Dual>::Column& column) {
  Eigen::VectorXd out(column.size());
  for (Eigen::Index i = 0; i < column.size(); ++i) out[i] = column[i].a;
  return out;
}

}  // namespace

Layout make_layout(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy) {
  return mesh.order() == 2 ? layout_of<Tri6>(mesh, anatomy) : layout_of<Tri3>(mesh, anatomy);
}

Fields<Dual> make_fields(const Model& model, const Scene& scene, const Eigen::Vector3d& gravity) {
  for (const EffectSetting& setting : model.effects)
    if (find_effect(setting.name) == nullptr)
      throw InputError(fmt::format("effect '{}' is not in the catalogue", setting.name));
  Fields<Dual> fields = base_fields(model, scene.layout, gravity);
  for (const Effect* effect : catalogue())
    for (const EffectSetting& setting : model.effects)
      if (setting.name == effect->name()) apply_effect(*effect, setting, scene, fields);
  return fields;
}

void check_effects_act(const Model& model, const Scene& scene) {
  for (const EffectSetting& setting : model.effects) {
    Model alone = model;
    alone.effects = {with_typical_values(setting)};
    Model without = model;
    without.effects.clear();
    const Eigen::Vector3d gravity = Eigen::Vector3d(1, 2, 3).normalized();  // no rotation leaves it as it is
    const auto with = values_of(make_fields(alone, scene, gravity));
    const auto base = values_of(make_fields(without, scene, gravity));
    const bool on_interface =
        with.interface_normal != base.interface_normal || with.interface_tangential != base.interface_tangential;
    const bool elsewhere = with.ln_young != base.ln_young || with.poisson != base.poisson ||
                           with.skin_modulus != base.skin_modulus || with.skin_prestretch != base.skin_prestretch ||
                           with.cut_stiffness != base.cut_stiffness || with.gravity != base.gravity;
    const bool on_stiffening = with.stiffening != base.stiffening;
    const auto refuse = [&setting](const char* reason) {
      throw InputError(fmt::format("effect '{}' cannot change anything here: {}", setting.name, reason));
    };
    if (elsewhere) continue;
    if (on_stiffening && model.breast.law != BulkLaw::neo_hookean)
      refuse("it acts on breast.law = \"neo_hookean\" only; change the law or remove the effect");
    if (on_interface && model.interface.kind != InterfaceKind::sliding)
      refuse("interface.kind = \"fixed\" holds the whole inner surface; use \"sliding\" or remove the effect");
    if (!on_interface && !on_stiffening)
      refuse("the mesh has no tissue of its kind, or nothing lies where it acts (offset_mm, arc); remove the effect");
  }
}

Fields<double> values_of(const Fields<Dual>& fields) {
  Fields<double> out;
  out.ln_young = values(fields.ln_young);
  out.poisson = values(fields.poisson);
  out.stiffening = values(fields.stiffening);
  out.skin_modulus = values(fields.skin_modulus);
  out.skin_prestretch = values(fields.skin_prestretch);
  out.interface_normal = values(fields.interface_normal);
  out.interface_tangential = values(fields.interface_tangential);
  out.cut_stiffness = values(fields.cut_stiffness);
  for (int i = 0; i < 3; ++i) out.gravity[i] = fields.gravity[i].a;
  out.density = fields.density.a;
  return out;
}

}  // namespace supine::simulation
