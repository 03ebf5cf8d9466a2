// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/creases.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/model_skin.h"
#include "meshing/tetrahedra/tetrahedralise.h"

namespace supine::diagnosis {
namespace {

/// Metric of two edges: their lengths and angle.
Eigen::Matrix2d metric(const Points& points, const Eigen::RowVector3i& triangle) {
  Eigen::Matrix<double, 2, 3> edges;
  edges.row(0) = points.row(triangle[1]) - points.row(triangle[0]);
  edges.row(1) = points.row(triangle[2]) - points.row(triangle[0]);
  return edges * edges.transpose();
}

Points middles(const Triangles& triangles, const Points& points) {
  Points all(triangles.rows(), 3);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    all.row(t) = points(triangles.row(t), Eigen::all).colwise().mean();
  return all;
}

}  // namespace

Eigen::Array<bool, Eigen::Dynamic, 1> creased(const Triangles& triangles, const Points& undeformed,
                                              const Points& deformed) {
  Eigen::Array<bool, Eigen::Dynamic, 1> is(triangles.rows());
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Eigen::Matrix2d before = metric(undeformed, triangles.row(t)), after = metric(deformed, triangles.row(t));
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> stretches(after, before, Eigen::EigenvaluesOnly);
    const Eigen::Vector2d squared = stretches.eigenvalues();  // ascending
    is[t] = 1 > creased_from * squared[0] * std::sqrt(std::max(squared[1], 0.0));
  }
  return is;
}

CreaseError crease_error(const calibration::MeasuredScene& scene, const calibration::Prediction& prediction,
                         const calibration::Residuals& residuals) {
  constexpr double share_of_edge = 1.0 / 3, edges_alike = 2;
  const Points& undeformed = prediction.solution.X;
  const Triangles triangles = calibration::ModelSkin(*scene.mesh, undeformed).triangles();
  const double edge_mm = meshing::mean_edge_mm({undeformed, triangles, {}});
  CreaseError error{Eigen::VectorXd::Zero(residuals.size()), edges_alike * edge_mm, 0};
  for (std::size_t m = 0; m < prediction.poses.size(); ++m) {
    const Points& x = prediction.solution.poses[m].x;
    std::vector<int> rows;
    const auto is = creased(triangles, undeformed, x);
    for (Eigen::Index t = 0; t < is.size(); ++t)
      if (is[t]) rows.push_back(static_cast<int>(t));
    if (rows.empty()) continue;
    const Points folds = middles(triangles(rows, Eigen::all), x);
    for (Eigen::Index r = 0; r < residuals.skin_rows(); ++r) {
      if (residuals.pose[r] != static_cast<int>(m)) continue;
      const double squared = (folds.rowwise() - residuals.on_skin.row(r)).rowwise().squaredNorm().minCoeff();
      if (squared > edge_mm * edge_mm) continue;
      error.sd_mm[r] = share_of_edge * edge_mm;
      ++error.points;
    }
  }
  return error;
}

}  // namespace supine::diagnosis
