// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/fields.h"

#include <fmt/core.h>

#include <algorithm>
#include <mutex>

#include "common/error.h"
#include "meshing/anatomy.h"
#include "meshing/supports.h"
#include "meshing/tet_mesh.h"
#include "simulation/elements/elements.h"
#include "simulation/elements/surface_geometry.h"
#include "simulation/skin_offset.h"

namespace supine::simulation {

class SkinOffsetOnce {
 public:
  const Eigen::VectorXd& of(const Scene& scene) {
    std::call_once(once_, [this, &scene] { column_ = skin_offset(scene.mesh, *scene.anatomy.muscle); });
    return column_;
  }

 private:
  std::once_flag once_;
  Eigen::VectorXd column_;
};

const Eigen::VectorXd& Layout::unit_skin_offset(const Scene& scene) const { return skin_offset_once->of(scene); }

namespace {

using reconstruction::Region;

Eigen::VectorXi faces_of(const meshing::TetMesh& mesh, std::initializer_list<Region> regions) {
  std::vector<int> rows;
  for (int f = 0; f < mesh.faces.rows(); ++f)
    for (const Region region : regions)
      if (mesh.region[f] == static_cast<int>(region)) rows.push_back(f);
  return Eigen::Map<Eigen::VectorXi>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

/// Faces on the supports, those of one support together. @param begin  out: Layout::support_begin
Eigen::VectorXi faces_on_supports(const meshing::TetMesh& mesh, std::vector<int>& begin) {
  const Eigen::VectorXi support = meshing::support_of_faces(mesh);
  const int count = std::max(1, static_cast<int>(mesh.support_names.size()));
  std::vector<int> rows;
  begin = {0};
  for (int s = 0; s < count; ++s) {
    for (int f = 0; f < support.size(); ++f)
      if (support[f] == s) rows.push_back(f);
    begin.push_back(static_cast<int>(rows.size()));
  }
  return Eigen::Map<Eigen::VectorXi>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

/// The breast that most of the corners belong to.
template <class Corners>
int breast_of(const meshing::Anatomy& anatomy, const Corners& corners) {
  Eigen::Index right = 0;
  for (const int corner : corners) right += anatomy.breast_of(corner);
  return 2 * right > corners.size() ? 1 : 0;
}

template <class Face>
FaceGroup quadrature_group(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, Eigen::VectorXi faces) {
  constexpr int n = Face::nodes;
  FaceGroup group;
  group.q.resize(faces.size() * Face::points, 2);
  group.area_mm2.resize(faces.size() * Face::points);
  group.breast.resize(faces.size() * Face::points);
  for (Eigen::Index f = 0; f < faces.size(); ++f) {
    const auto nodes = gather<n>(mesh.points, mesh.faces, faces[f]);
    for (int p = 0; p < Face::points; ++p) {
      const Eigen::Index row = f * Face::points + p;
      group.q.row(row).setZero();
      group.breast[row] = breast_of(anatomy, mesh.faces.row(faces[f]).head<3>());
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
  group.breast.resize(faces.size());
  for (Eigen::Index f = 0; f < faces.size(); ++f) {
    const auto corners = mesh.faces.row(faces[f]).head<3>();
    group.breast[f] = breast_of(anatomy, corners);
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
  layout.interface = quadrature_group<Face>(mesh, anatomy, faces_on_supports(mesh, layout.support_begin));
  layout.cut = quadrature_group<Face>(mesh, anatomy, faces_of(mesh, {Region::cut}));
  layout.skin_offset_once = std::make_shared<SkinOffsetOnce>();
  layout.cell_q.resize(mesh.cells.rows(), 2);
  layout.cell_breast.resize(mesh.cells.rows());
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    layout.cell_q.row(c).setZero();
    layout.cell_breast[c] = breast_of(anatomy, mesh.cells.row(c).head<4>());
    for (int a = 0; a < 4; ++a) layout.cell_q.row(c) += 0.25 * anatomy.q.row(mesh.cells(c, a));
  }
  return layout;
}

template <class Part>
Fields<double> each_entry(const Fields<Dual>& fields, const Part& part) {
  Fields<double> out;
  for (std::size_t c = 0; c < std::size(field_columns<Dual>); ++c)
    out.*field_columns<double>[c].column = (fields.*field_columns<Dual>[c].column).unaryExpr(part);
  return out;
}

}  // namespace

Layout make_layout(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy) {
  if (anatomy.q.rows() != mesh.points.rows())
    throw InputError(
        fmt::format("the anatomy was computed on a mesh of {} points, this mesh has {}; compute it on this mesh",
                    anatomy.q.rows(), mesh.points.rows()));
  return mesh.order() == 2 ? layout_of<Tri6>(mesh, anatomy) : layout_of<Tri3>(mesh, anatomy);
}

Fields<double> values_of(const Fields<Dual>& fields) {
  return each_entry(fields, [](const Dual& number) { return number.a; });
}

Fields<double> derivatives_of(const Fields<Dual>& fields) {
  return each_entry(fields, [](const Dual& number) { return number.v[0]; });
}

}  // namespace supine::simulation
