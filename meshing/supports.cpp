// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/supports.h"

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "meshing/surface/triangle_tree.h"

namespace supine::meshing {
namespace {

using reconstruction::Region;

bool lies_on_support(int region) {
  return region == static_cast<int>(Region::inner) || region == static_cast<int>(Region::ligament);
}

struct Corners {
  Eigen::Vector3d a, b, c;
  Eigen::Vector3d vector_area() const { return (b - a).cross(c - a) / 2; }
};

Corners corners_of(const TetMesh& mesh, Eigen::Index f) {
  return {mesh.points.row(mesh.faces(f, 0)), mesh.points.row(mesh.faces(f, 1)), mesh.points.row(mesh.faces(f, 2))};
}

}  // namespace

Eigen::VectorXi support_of_faces(const TetMesh& mesh) {
  Eigen::VectorXi support(mesh.faces.rows());
  for (Eigen::Index f = 0; f < support.size(); ++f) support[f] = lies_on_support(mesh.region[f]) ? 0 : -1;
  if (mesh.support_names.size() < 2) return support;
  const TriangleTree sheet(mesh.muscle.points, mesh.muscle.triangles);
  for (Eigen::Index f = 0; f < support.size(); ++f) {
    if (support[f] < 0) continue;
    const Corners at = corners_of(mesh, f);
    support[f] = mesh.muscle_support[sheet.closest(Eigen::Vector3d((at.a + at.b + at.c) / 3)).triangle];
  }
  return support;
}

SupportArea support_area(const TetMesh& mesh, const Eigen::VectorXi& support_of_face, int support) {
  SupportArea result;
  Eigen::Vector3d vector_area = Eigen::Vector3d::Zero();
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (support_of_face[f] != support) continue;
    const Corners at = corners_of(mesh, f);
    const double area = at.vector_area().norm();
    result.area_mm2 += area;
    result.centroid_mm += area * (at.a + at.b + at.c) / 3;
    vector_area += at.vector_area();
  }
  if (result.area_mm2 == 0) return result;
  result.centroid_mm /= result.area_mm2;
  result.normal = vector_area.norm() > 0 ? Eigen::Vector3d(vector_area.normalized()) : Eigen::Vector3d::UnitX();
  const Eigen::Matrix3d in_plane = Eigen::Matrix3d::Identity() - result.normal * result.normal.transpose();
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (support_of_face[f] != support) continue;
    const Corners at = corners_of(mesh, f);
    // Exact for squares of the place: the middles of the edges.
    const std::array<Eigen::Vector3d, 3> middles = {(at.a + at.b) / 2, (at.b + at.c) / 2, (at.c + at.a) / 2};
    for (const Eigen::Vector3d& middle : middles)
      result.polar_mm4 += at.vector_area().norm() / 3 * (in_plane * (middle - result.centroid_mm)).squaredNorm();
  }
  result.bending_mm4 = result.polar_mm4 / 2;
  return result;
}

reconstruction::Surface sheet_of(const TetMesh& mesh, int support) {
  if (mesh.support_names.size() < 2) return mesh.muscle;
  std::vector<int> rows, number(mesh.muscle.points.rows(), -1), used;
  for (int t = 0; t < mesh.muscle.triangles.rows(); ++t)
    if (mesh.muscle_support[t] == support) rows.push_back(t);
  reconstruction::Surface sheet;
  sheet.triangles = mesh.muscle.triangles(rows, Eigen::all);
  for (int& node : sheet.triangles.reshaped()) {
    if (number[node] < 0) {
      number[node] = static_cast<int>(used.size());
      used.push_back(node);
    }
    node = number[node];
  }
  sheet.points = mesh.muscle.points(used, Eigen::all);
  return sheet;
}

}  // namespace supine::meshing
