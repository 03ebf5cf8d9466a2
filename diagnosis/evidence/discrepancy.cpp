// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/discrepancy.h"

#include <Eigen/Dense>
#include <cmath>
#include <initializer_list>

#include "diagnosis/evidence/field_modes.h"
#include "reconstruction/surface.h"

namespace supine::diagnosis {
namespace {

using reconstruction::Region;

constexpr int centres_per_surface = 60;
constexpr double length_mm = 25;

/// Faces of the undeformed body with what integrals over them need.
struct Surface {
  Indices nodes;
  Points middle;
  Eigen::VectorXd area;
};

Surface surface_of(const meshing::TetMesh& mesh, const Points& X, std::initializer_list<Region> regions) {
  std::vector<int> faces;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (const Region region : regions)
      if (mesh.region[f] == static_cast<int>(region)) faces.push_back(static_cast<int>(f));
  Surface surface{mesh.faces(faces, Eigen::all), Points(faces.size(), 3), Eigen::VectorXd(faces.size())};
  for (Eigen::Index f = 0; f < surface.nodes.rows(); ++f) {
    const Eigen::RowVector3d a = X.row(surface.nodes(f, 0)), b = X.row(surface.nodes(f, 1)),
                             c = X.row(surface.nodes(f, 2));
    surface.middle.row(f) = (a + b + c) / 3;
    surface.area[f] = 0.5 * (b - a).cross(c - a).norm();
  }
  return surface;
}

/// Weight of the traction on each face of the shapes that bumps with correlated strengths take, #faces by #centres.
Eigen::MatrixXd tractions(const Surface& surface) {
  const Points centres = surface.middle(spread_out(surface.middle, centres_per_surface), Eigen::all);
  const double width = 0.5 * std::sqrt(surface.area.sum() / static_cast<double>(centres.rows()));
  Eigen::MatrixXd strengths = gaussian_kernel(centres, centres, length_mm);
  strengths.diagonal().array() += 1e-9;  // near centres are all but alike
  return gaussian_kernel(surface.middle, centres, width) * Eigen::MatrixXd(strengths.llt().matrixL());
}

/// Forces on the nodes of a traction along one axis, 3 per node.
Eigen::VectorXd nodal_forces(const Surface& surface, const Eigen::VectorXd& traction, int axis, Eigen::Index nodes) {
  Eigen::VectorXd force = Eigen::VectorXd::Zero(3 * nodes);
  // A constant traction pulls on the corners of a straight triangle, on the middles of the edges of a curved one.
  const int first = surface.nodes.cols() == 6 ? 3 : 0;
  for (Eigen::Index f = 0; f < traction.size(); ++f)
    for (int a = first; a < first + 3; ++a) force[3 * surface.nodes(f, a) + axis] += surface.area[f] * traction[f] / 3;
  return force;
}

}  // namespace

std::vector<Eigen::VectorXd> discrepancy_forces(const meshing::TetMesh& mesh, const Points& X) {
  std::vector<Eigen::VectorXd> forces;
  for (const auto& regions : {std::vector{Region::skin}, std::vector{Region::inner, Region::ligament}}) {
    const Surface surface = regions.size() == 1 ? surface_of(mesh, X, {Region::skin})
                                                : surface_of(mesh, X, {Region::inner, Region::ligament});
    if (surface.nodes.rows() == 0) continue;
    const Eigen::MatrixXd traction = tractions(surface);
    for (Eigen::Index c = 0; c < traction.cols(); ++c)
      for (int axis = 0; axis < 3; ++axis) forces.push_back(nodal_forces(surface, traction.col(c), axis, X.rows()));
  }
  return forces;
}

Discrepancy discrepancy_of(const meshing::TetMesh& mesh, const simulation::Sensitivities& sensitivities,
                           const calibration::Prediction& prediction, const calibration::Residuals& residuals,
                           const calibration::Clusters& clusters) {
  Discrepancy found{discrepancy_forces(mesh, prediction.solution.X), {}, {}};
  found.columns.resize(clusters.pose.size(), static_cast<Eigen::Index>(found.forces.size()));
  std::vector<std::vector<Points>> moved;  // per pose and force
  for (std::size_t pose = 0; pose < prediction.poses.size(); ++pose)
    moved.push_back(sensitivities.moved_by(pose, found.forces));
  for (std::size_t f = 0; f < found.forces.size(); ++f) {
    std::vector<Points> moves;
    for (const std::vector<Points>& by_force : moved) moves.push_back(by_force[f]);
    found.columns.col(static_cast<Eigen::Index>(f)) = clusters.means(distance_change(prediction, residuals, moves));
  }
  found.kernel = found.columns * found.columns.transpose();
  for (Eigen::Index i = 0; i < found.kernel.rows(); ++i)
    for (Eigen::Index j = 0; j < found.kernel.cols(); ++j)
      if (clusters.pose[i] != clusters.pose[j]) found.kernel(i, j) *= common_to_poses;
  const Eigen::ArrayXd of_skin = (clusters.kind.array() == 0).cast<double>();
  const double variance = (1 - share_beyond_forces) * of_skin.sum() / of_skin.matrix().dot(found.kernel.diagonal());
  found.kernel *= variance;
  found.columns *= std::sqrt(variance);
  for (Eigen::VectorXd& force : found.forces) force *= std::sqrt(variance);
  const Eigen::MatrixXd plain = gaussian_kernel(clusters.place, clusters.place, beyond_forces_length_mm);
  for (Eigen::Index i = 0; i < found.kernel.rows(); ++i)
    for (Eigen::Index j = 0; j < found.kernel.cols(); ++j)
      if (clusters.related(i, j)) found.kernel(i, j) += share_beyond_forces * plain(i, j);
  return found;
}

}  // namespace supine::diagnosis
