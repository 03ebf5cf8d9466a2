// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/export/exported_pose.h"

#include <cmath>
#include <map>

#include "simulation/elements/elements.h"
#include "simulation/elements/surface_geometry.h"
#include "simulation/elements/tet_geometry.h"
#include "simulation/model_fields.h"

namespace supine::simulation {
namespace {

void add_materials(const Fields<double>& fields, ExportedPose& pose) {
  std::map<std::pair<long, double>, int> known;
  pose.material.resize(fields.ln_young.size());
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c) {
    const long step = std::lround(fields.ln_young[c] / exported_ln_young_step);
    const auto [found, added] = known.emplace(std::pair{step, fields.poisson[c]}, static_cast<int>(known.size()));
    // The first of a step stands for all of it: one modulus over the whole breast stays what it is, to the last digit.
    if (added) pose.materials.push_back({std::exp(fields.ln_young[c]), fields.poisson[c]});
    pose.material[c] = found->second;
  }
}

void add_skin(const meshing::TetMesh& mesh, const Model& model, const Layout& layout, const Fields<double>& fields,
              ExportedPose& pose) {
  if (model.skin.young_modulus_kpa.value == 0) return;
  const double thickness_mm = model.skin.thickness_mm.value;
  pose.skin_law = model.skin.law;
  pose.skin_material = {fields.skin_modulus[0] / thickness_mm, fields.skin_poisson[0]};
  const Eigen::Index count = layout.skin.faces.size();
  pose.skin.resize(count, 4);
  pose.X.conservativeResize(pose.nodes + count, 3);
  for (Eigen::Index f = 0; f < count; ++f) {
    const Eigen::RowVector3i face = mesh.faces.row(layout.skin.faces[f]).head<3>();
    const Eigen::RowVector3d a = pose.X.row(face[0]), b = pose.X.row(face[1]), c = pose.X.row(face[2]);
    const Eigen::RowVector3d normal = (b - a).cross(c - a).normalized();
    pose.skin.row(f) << face[0], face[1], face[2], static_cast<int>(pose.nodes + f);
    pose.X.row(pose.nodes + f) = (a + b + c) / 3 + 3 * thickness_mm * normal;
  }
}

void add_weight(const meshing::TetMesh& mesh, const Model& model, const Points& X, const Fields<double>& fields,
                ExportedPose& pose) {
  const Points imaged = mesh.points + Eigen::Map<const Points>(fields.imaged_offset.data(), mesh.points.rows(), 3);
  const Points& shape = model.breast.density_refers_to == DensityReference::undeformed ? X : imaged;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const auto point = tet_point<Tet4>(gather<4>(shape, mesh.cells, c), 0);
    const Eigen::RowVector3d share = 0.25 * point.volume * fields.density[c] * fields.gravity.transpose();
    for (int a = 0; a < 4; ++a) pose.force.row(mesh.cells(c, a)) += share;
  }
}

void add_traction(const meshing::TetMesh& mesh, const Layout& layout, const Points& X, const Fields<double>& fields,
                  ExportedPose& pose) {
  for (Eigen::Index f = 0; f < layout.skin.faces.size(); ++f) {
    const Eigen::RowVector3d traction = fields.skin_traction.segment<3>(3 * f).transpose();
    if (traction.isZero(0)) continue;
    const auto rest = gather<3>(X, mesh.faces, layout.skin.faces[f]);
    for (int p = 0; p < Tri3::points; ++p)
      for (int a = 0; a < 3; ++a)
        pose.force.row(mesh.faces(layout.skin.faces[f], a)) +=
            face_point<Tri3>(rest, p).area * Tri3::table().value[p][a] * traction;
  }
}

/// A point of a face, and what it is bound to.
struct FacePlace {
  std::array<int, 3> nodes;
  Eigen::Vector3d weight, X, x;
  double area_mm2;
};

template <class Use>
void for_each_point(const meshing::TetMesh& mesh, const FaceGroup& group, const Points& X, const Points& x,
                    const Use& use) {
  for (Eigen::Index f = 0; f < group.faces.size(); ++f) {
    const int face = group.faces[f];
    const auto rest = gather<3>(X, mesh.faces, face), now = gather<3>(x, mesh.faces, face);
    for (int p = 0; p < Tri3::points; ++p) {
      const auto& value = Tri3::table().value[p];
      use(f * Tri3::points + p, FacePlace{{mesh.faces(face, 0), mesh.faces(face, 1), mesh.faces(face, 2)},
                                          value,
                                          rest.transpose() * value,
                                          now.transpose() * value,
                                          face_point<Tri3>(rest, p).area});
    }
  }
}

void add_spring(const FacePlace& at, const Eigen::Vector3d& direction, double stiffness, double rest_mm,
                ExportedPose& pose) {
  if (stiffness > 0) pose.springs.push_back({at.nodes, at.weight, direction, stiffness, rest_mm});
}

void add_interface(const meshing::TetMesh& mesh, const meshing::MuscleDistance& muscle, const Layout& layout,
                   const Points& X, const Points& x, const Fields<double>& fields, ExportedPose& pose) {
  for_each_point(mesh, layout.interface, X, x, [&](Eigen::Index p, const FacePlace& at) {
    const auto now = muscle.at(at.x), before = muscle.at(at.X);
    const double steepness = now.gradient.norm(), gap_mm = now.value_mm - before.value_mm - fields.muscle_offset[p];
    const Eigen::Vector3d touching = now.gradient / steepness, normal = before.gradient.normalized();
    add_spring(at, touching, fields.interface_normal[p] * at.area_mm2 * steepness * steepness,
               touching.dot(at.x - at.X) - gap_mm / steepness, pose);
    const Eigen::Vector3d across = normal.unitOrthogonal();
    for (const Eigen::Vector3d& tangent : {across, Eigen::Vector3d(normal.cross(across))})
      add_spring(at, tangent, fields.interface_tangential[p] * at.area_mm2, 0, pose);
  });
}

void add_cut(const meshing::TetMesh& mesh, const Layout& layout, const Points& X, const Points& x,
             const Fields<double>& fields, ExportedPose& pose) {
  for_each_point(mesh, layout.cut, X, x, [&](Eigen::Index p, const FacePlace& at) {
    for (int k = 0; k < 3; ++k)
      add_spring(at, Eigen::Vector3d::Unit(k), fields.cut_stiffness[p] * at.area_mm2, 0, pose);
  });
}

void hold(const meshing::TetMesh& mesh, const FaceGroup& group, std::vector<char>& held) {
  for (const int face : group.faces)
    for (int a = 0; a < 3; ++a) held[mesh.faces(face, a)] = 1;
}

}  // namespace

ExportedPose export_pose(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                         const PoseLoad& load, const Points& X, const Points& x) {
  const Layout layout = make_layout(mesh, anatomy);
  const auto fields = values_of(make_fields(model, {mesh, anatomy, layout, load.name}, load.gravity));
  ExportedPose pose;
  pose.name = load.name;
  pose.law = model.breast.law;
  pose.nodes = static_cast<int>(mesh.points.rows());
  pose.X = X;
  pose.answer = x;
  pose.cells = mesh.cells;
  pose.force = Points::Zero(pose.nodes, 3);
  add_materials(fields, pose);
  add_skin(mesh, model, layout, fields, pose);
  add_weight(mesh, model, X, fields, pose);
  add_traction(mesh, layout, X, fields, pose);
  std::vector<char> held(pose.nodes, 0);
  if (model.interface.kind == InterfaceKind::fixed) hold(mesh, layout.interface, held);
  if (model.cut.kind == CutKind::held) hold(mesh, layout.cut, held);
  for (int n = 0; n < pose.nodes; ++n)
    if (held[n]) pose.held.push_back(n);
  if (model.interface.kind == InterfaceKind::sliding) add_interface(mesh, *anatomy.muscle, layout, X, x, fields, pose);
  if (model.cut.kind == CutKind::elastic) add_cut(mesh, layout, X, x, fields, pose);
  return pose;
}

Points force_with_springs_at_rest(const ExportedPose& pose) {
  Points force = pose.force;
  for (const FaceSpring& spring : pose.springs)
    for (int a = 0; a < 3; ++a)
      force.row(spring.nodes[a]) += spring.stiffness * spring.rest_mm * spring.weight[a] * spring.direction.transpose();
  return force;
}

}  // namespace supine::simulation
