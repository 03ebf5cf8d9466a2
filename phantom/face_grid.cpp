// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/face_grid.h"

#include <Eigen/Geometry>
#include <array>
#include <map>

#include "meshing/topology.h"

namespace supine::phantom {

FaceGrid::FaceGrid(const meshing::TetMesh& mesh, std::vector<int> faces, int steps) : mesh_(mesh) {
  // A point is known by its corners' weights: those on an edge or a corner are met again from the next face.
  std::map<std::array<std::pair<int, int>, 3>, int> known;
  const auto number = [&](int face, int j, int k) {
    std::array<std::pair<int, int>, 3> key;
    const std::array<int, 3> weight = {steps - j - k, j, k};
    for (int a = 0; a < 3; ++a) key[a] = weight[a] == 0 ? std::pair(-1, 0) : std::pair(mesh.faces(face, a), weight[a]);
    std::sort(key.begin(), key.end());
    const auto [found, added] = known.emplace(key, static_cast<int>(spots_.size()));
    if (added) spots_.push_back({face, static_cast<double>(j) / steps, static_cast<double>(k) / steps});
    return found->second;
  };
  const auto count = static_cast<Eigen::Index>(faces.size()) * steps * steps;
  triangles_.resize(count, 3);
  region_.resize(count);
  Eigen::Index row = 0;
  for (const int f : faces)
    for (int j = 0; j < steps; ++j)
      for (int k = 0; j + k < steps; ++k) {
        region_[row] = mesh.region[f];
        triangles_.row(row++) << number(f, j, k), number(f, j + 1, k), number(f, j, k + 1);
        if (j + k + 1 == steps) continue;
        region_[row] = mesh.region[f];
        triangles_.row(row++) << number(f, j + 1, k), number(f, j + 1, k + 1), number(f, j, k + 1);
      }
}

Points FaceGrid::at(const Points& nodes) const {
  Points result(points(), 3);
  for (Eigen::Index i = 0; i < points(); ++i)
    result.row(i) = meshing::face_point(nodes, mesh_.faces, spots_[i].face, spots_[i].b, spots_[i].c);
  return result;
}

Points point_normals(const Points& points, const Triangles& triangles) {
  Points normals = Points::Zero(points.rows(), 3);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Eigen::RowVector3d a = points.row(triangles(t, 0));
    const Eigen::RowVector3d normal =
        (points.row(triangles(t, 1)) - a).cross(Eigen::RowVector3d(points.row(triangles(t, 2)) - a));
    for (int k = 0; k < 3; ++k) normals.row(triangles(t, k)) += normal;
  }
  normals.rowwise().normalize();
  return normals;
}

std::vector<int> faces_with(const meshing::TetMesh& mesh, int region) {
  std::vector<int> faces;
  for (int f = 0; f < mesh.faces.rows(); ++f)
    if (region == 0 || mesh.region[f] == region) faces.push_back(f);
  return faces;
}

}  // namespace supine::phantom
