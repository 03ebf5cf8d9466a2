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
constexpr double length_mm = 25, share_beyond_forces = 0.1;

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

Eigen::MatrixXd discrepancy_kernel(const meshing::TetMesh& mesh, const simulation::Sensitivities& sensitivities,
                                   const calibration::Prediction& prediction, const calibration::Residuals& residuals,
                                   const calibration::Clusters& clusters) {
  const Points& X = prediction.solution.X;
  Eigen::MatrixXd columns(clusters.pose.size(), 0);
  for (const auto& regions : {std::vector{Region::skin}, std::vector{Region::inner, Region::ligament}}) {
    const Surface surface = regions.size() == 1 ? surface_of(mesh, X, {Region::skin})
                                                : surface_of(mesh, X, {Region::inner, Region::ligament});
    if (surface.nodes.rows() == 0) continue;
    const Eigen::MatrixXd traction = tractions(surface);
    for (Eigen::Index c = 0; c < traction.cols(); ++c)
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::VectorXd force = nodal_forces(surface, traction.col(c), axis, X.rows());
        std::vector<Points> moves;
        for (std::size_t pose = 0; pose < prediction.poses.size(); ++pose)
          moves.push_back(sensitivities.moved_by(pose, force));
        columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
        columns.rightCols<1>() = clusters.means(distance_change(prediction, residuals, moves));
      }
  }
  Eigen::MatrixXd kernel = columns * columns.transpose();
  for (Eigen::Index i = 0; i < kernel.rows(); ++i)
    for (Eigen::Index j = 0; j < kernel.cols(); ++j)
      if (clusters.pose[i] != clusters.pose[j]) kernel(i, j) *= 0.5;
  const Eigen::ArrayXd of_skin = (clusters.kind.array() == 0).cast<double>();
  kernel *= (1 - share_beyond_forces) * of_skin.sum() / of_skin.matrix().dot(kernel.diagonal());
  const Eigen::MatrixXd plain = gaussian_kernel(clusters.place, clusters.place, length_mm);
  for (Eigen::Index i = 0; i < kernel.rows(); ++i)
    for (Eigen::Index j = 0; j < kernel.cols(); ++j)
      if (clusters.related(i, j)) kernel(i, j) += share_beyond_forces * plain(i, j);
  return kernel;
}

}  // namespace supine::diagnosis
