// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/skin_offset.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <vector>

#include "common/error.h"
#include "meshing/anatomy/muscle_distance.h"
#include "meshing/tet_mesh.h"
#include "simulation/elements/elements.h"

namespace supine::simulation {
namespace {

using reconstruction::Region;

constexpr double fade_mm = 10;

enum class Kind : char { inside, skin, held };

std::vector<Kind> kinds_of(const meshing::TetMesh& mesh) {
  std::vector<Kind> kind(mesh.points.rows(), Kind::inside);
  for (const bool held : {false, true})
    for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
      if ((mesh.region[f] != static_cast<int>(Region::skin)) == held)
        for (const int node : mesh.faces.row(f)) kind[node] = held ? Kind::held : Kind::skin;
  return kind;
}

/// The vector area of each skin face, added to all its nodes.
template <class Face>
void add_vector_areas(const meshing::TetMesh& mesh, Points& sum) {
  for (int f = 0; f < mesh.faces.rows(); ++f) {
    if (mesh.region[f] != static_cast<int>(Region::skin)) continue;
    const auto nodes = gather<Face::nodes>(mesh.points, mesh.faces, f);
    Eigen::Vector3d area = Eigen::Vector3d::Zero();
    for (int p = 0; p < Face::points; ++p) {
      const Eigen::Matrix<double, 3, 2> tangent = nodes.transpose() * Face::table().gradient[p];
      area += Face::table().weight[p] * tangent.col(0).cross(tangent.col(1));
    }
    for (const int node : mesh.faces.row(f)) sum.row(node) += area.transpose();
  }
}

/// 0 at held nodes and on the muscle, 1 from fade_mm on, C1.
double fading(const Eigen::RowVector3d& point, const std::vector<Eigen::RowVector3d>& held, double height_mm) {
  double nearest2 = fade_mm * fade_mm;
  for (const auto& other : held) nearest2 = std::min(nearest2, (point - other).squaredNorm());
  const double t = std::clamp(std::min(std::sqrt(nearest2), height_mm) / fade_mm, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Points skin_motion(const meshing::TetMesh& mesh, const meshing::MuscleDistance& muscle, const std::vector<Kind>& kind) {
  Points motion = Points::Zero(mesh.points.rows(), 3);
  if (mesh.order() == 2)
    add_vector_areas<Tri6>(mesh, motion);
  else
    add_vector_areas<Tri3>(mesh, motion);
  std::vector<Eigen::RowVector3d> border;  // shared by the skin and what stays
  for (Eigen::Index n = 0; n < motion.rows(); ++n)
    if (kind[n] == Kind::held && !motion.row(n).isZero(0)) border.push_back(mesh.points.row(n));
#pragma omp parallel for schedule(static)
  for (Eigen::Index n = 0; n < motion.rows(); ++n) {
    if (kind[n] == Kind::skin && !motion.row(n).isZero(0)) {
      const Eigen::RowVector3d at = mesh.points.row(n);
      motion.row(n) *= fading(at, border, muscle.value(at.transpose())) / motion.row(n).norm();
    } else {
      motion.row(n).setZero();
    }
  }
  return motion;
}

/// Fills in the rows of corners inside from those on the boundary.
void extend_harmonically(const meshing::TetMesh& mesh, const std::vector<Kind>& kind, Points& motion) {
  std::vector<int> row(kind.size(), -1);
  int unknowns = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    for (int a = 0; a < 4; ++a)
      if (const int n = mesh.cells(c, a); kind[n] == Kind::inside && row[n] < 0) row[n] = unknowns++;
  if (unknowns == 0) return;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(unknowns, 3);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const int n = mesh.cells(c, a), m = mesh.cells(c, b);
        if (a == b || row[n] < 0) continue;
        const double weight = 1 / (mesh.points.row(n) - mesh.points.row(m)).squaredNorm();
        entries.emplace_back(row[n], row[n], weight);
        if (row[m] >= 0)
          entries.emplace_back(row[n], row[m], -weight);
        else
          right.row(row[n]) += weight * motion.row(m);
      }
  Eigen::SparseMatrix<double> laplacian(unknowns, unknowns);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(laplacian);
  if (solver.info() != Eigen::Success)
    throw NumericalFailure("segmentation_offset: the nodes inside cannot follow the skin; part of the mesh has none");
  const Eigen::MatrixXd inside = solver.solve(right);
  for (std::size_t n = 0; n < row.size(); ++n)
    if (row[n] >= 0) motion.row(static_cast<Eigen::Index>(n)) = inside.row(row[n]);
}

void move_middles(const meshing::TetMesh& mesh, Points& motion) {
  static constexpr int edges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
    for (int e = 0; e < 6; ++e)
      motion.row(mesh.cells(c, 4 + e)) =
          0.5 * (motion.row(mesh.cells(c, edges[e][0])) + motion.row(mesh.cells(c, edges[e][1])));
}

}  // namespace

Eigen::VectorXd skin_offset(const meshing::TetMesh& mesh, const meshing::MuscleDistance& muscle) {
  const std::vector<Kind> kind = kinds_of(mesh);
  Points motion = skin_motion(mesh, muscle, kind);
  extend_harmonically(mesh, kind, motion);
  if (mesh.order() == 2) move_middles(mesh, motion);
  return Eigen::Map<const Eigen::VectorXd>(motion.data(), motion.size());
}

}  // namespace supine::simulation
