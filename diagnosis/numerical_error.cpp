// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/numerical_error.h"

#include <algorithm>
#include <cmath>

#include "calibration/error_model.h"
#include "common/error.h"
#include "diagnosis/other_mesh.h"

namespace supine::diagnosis {
namespace {

using calibration::Residuals;

constexpr double edge_share = 0.5;      // of the finer mesh's edges where skin and cut face meet
constexpr double triangle_share = 0.8;  // of the coarser surface

double mean_square(const Eigen::VectorXd& x) { return x.squaredNorm() / static_cast<double>(x.size()); }

/// Change of distance of the residuals' points. Points beyond the border of the other mesh keep theirs.
Eigen::VectorXd change_on(const calibration::Scene& scene, const meshing::TetMesh& mesh, const simulation::Model& model,
                          const Residuals& residuals) {
  const meshing::Anatomy anatomy = meshing::compute_anatomy(mesh, scene.anatomy->side);
  calibration::Scene other = scene;
  other.mesh = &mesh;
  other.anatomy = &anatomy;
  calibration::Evaluator evaluator(other, model);
  const calibration::Prediction prediction = evaluator.predict(model);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(residuals.size());
  for (Eigen::Index r = 0; r < residuals.size(); ++r) {
    const auto& distances = prediction.poses[static_cast<std::size_t>(residuals.pose[r])].distances;
    const int point = residuals.point[r];
    if (!distances.closest.on_border[point]) change[r] = distances.distance_mm[point] - residuals.distance_mm[r];
  }
  return change;
}

}  // namespace

double correlation_length_mm(const Residuals& residuals, const Eigen::VectorXd& field) {
  constexpr double near_mm = 6, far_mm = 14;
  constexpr double shortest_mm = 5, longest_mm = 60;
  const calibration::Clusters clusters = calibration::cluster_points(residuals, 450);
  const Eigen::VectorXd x = clusters.means(field);
  double product = 0, distance = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    for (Eigen::Index j = 0; j < i; ++j) {
      const double r = (clusters.place.row(i) - clusters.place.row(j)).norm();
      if (clusters.pose[i] != clusters.pose[j] || r < near_mm || r > far_mm) continue;
      product += x[i] * x[j];
      distance += r;
      ++count;
    }
  const double variance = mean_square(x);
  if (count == 0 || !(variance > 0) || !(product > 0)) return shortest_mm;
  const double correlation = std::min(product / (count * variance), 0.99);
  return std::clamp(-distance / count / std::log(correlation), shortest_mm, longest_mm);
}

NumericalError measure_numerical_error(const calibration::Scene& scene, const simulation::Model& model,
                                       const calibration::Fit& fit) {
  NumericalError result;
  Eigen::VectorXd change[2];
  std::string reason[2];
#pragma omp parallel for schedule(static, 1)
  for (int k = 0; k < 2; ++k) {
    try {
      const meshing::TetMesh mesh = k == 0 ? other_mesh(*scene.mesh, *scene.anatomy, edge_share)
                                           : coarser_mesh(*scene.mesh, *scene.anatomy, triangle_share);
      change[k] = change_on(scene, mesh, model, fit.residuals);
    } catch (const std::exception& failure) {
      reason[k] = std::string(k == 0 ? "finer" : "coarser") + " mesh: " + failure.what();
      change[k] = Eigen::VectorXd::Zero(fit.residuals.size());
    }
  }
  for (const std::string& r : reason)
    if (!r.empty()) result.failed.push_back(r);
  if (result.failed.size() == 2)
    throw NumericalFailure("the error of the mesh cannot be measured: " + reason[0] + "; " + reason[1]);
  result.finer_mm = change[0];
  result.coarser_mm = change[1];
  const double twice = result.failed.empty() ? 1 : 2;
  result.spread_mm = std::sqrt(twice * (mean_square(change[0]) + mean_square(change[1])));
  result.length_mm = 0.5 * twice *
                     ((reason[0].empty() ? correlation_length_mm(fit.residuals, change[0]) : 0) +
                      (reason[1].empty() ? correlation_length_mm(fit.residuals, change[1]) : 0));
  return result;
}

}  // namespace supine::diagnosis
