// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/model_skin.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"

namespace supine::calibration {
namespace {

bool is_skin(const meshing::TetMesh& mesh, Eigen::Index face) {
  return mesh.region[face] == static_cast<int>(reconstruction::Region::skin);
}

Triangles skin_triangles(const meshing::TetMesh& mesh) {
  // Of a face with nodes 0 1 2 and the middles 3 (01), 4 (12), 5 (20).
  constexpr int quarters[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
  std::vector<Eigen::RowVector3i> rows;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (!is_skin(mesh, f)) continue;
    if (mesh.faces.cols() == 3) {
      rows.emplace_back(mesh.faces.row(f));
      continue;
    }
    for (const auto& quarter : quarters) {
      rows.emplace_back(mesh.faces(f, quarter[0]), mesh.faces(f, quarter[1]), mesh.faces(f, quarter[2]));
    }
  }
  if (rows.empty()) {
    throw InputError(fmt::format("none of the model's {} boundary faces is skin (region 2); a scan sees nothing else",
                                 mesh.faces.rows()));
  }
  Triangles triangles(rows.size(), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) triangles.row(i) = rows[i];
  return triangles;
}

const Points& checked(const meshing::TetMesh& mesh, const Points& positions) {
  if (positions.rows() != mesh.points.rows()) {
    throw InputError(fmt::format("{} positions for a mesh of {} points", positions.rows(), mesh.points.rows()));
  }
  return positions;
}

}  // namespace

ModelSkin::ModelSkin(const meshing::TetMesh& mesh, const Points& positions)
    : ModelSkin(checked(mesh, positions), skin_triangles(mesh)) {
  if (mesh.faces.cols() == 3) return;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    if (is_skin(mesh, f)) rows.push_back(f);
  curved_.emplace(mesh.faces(rows, Eigen::all));
  of_curved_.emplace(curved_->corners(positions), curved_->triangles());
}

ModelSkin::ModelSkin(const Points& points, const Triangles& triangles) : distance_(points, triangles) {
  nodes_.assign(triangles.data(), triangles.data() + triangles.size());
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
}

void ModelSkin::move(const Points& positions) {
  distance_.move(positions);
  if (curved_) of_curved_->move(curved_->corners(positions));
}

void ModelSkin::closest(const Points& queries, ClosestPoints& result) const {
  if (!curved_) return distance_.closest(queries, result);
  of_curved_->closest(queries, result);
  curved_->by_faces(result);
}

Points ModelSkin::node_points() const { return distance_.points()(nodes_, Eigen::all); }

Points ModelSkin::node_normals() const { return distance_.normals()(nodes_, Eigen::all); }

SkinAreas anatomical_areas(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy) {
  SkinAreas areas{anatomy.all_area_names(), Eigen::VectorXi::Constant(mesh.points.rows(), -1)};
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (!is_skin(mesh, f)) continue;
    for (const int node : mesh.faces.row(f)) {
      if (areas.of_point[node] >= 0) continue;
      const std::string name = anatomy.area_name_of(node);
      areas.of_point[node] =
          static_cast<int>(std::find(areas.names.begin(), areas.names.end(), name) - areas.names.begin());
    }
  }
  return areas;
}

}  // namespace supine::calibration
