// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/residuals.h"

#include "meshing/anatomy.h"

namespace supine::calibration {

PointMask points_over_skin(const Prediction& prediction) {
  PointMask mask;
  for (const PosePrediction& pose : prediction.poses) mask.emplace_back(!pose.distances.closest.on_border);
  return mask;
}

Residuals residuals_of(const MeasuredScene& scene, const Prediction& prediction, const PointMask& mask,
                       const std::vector<double>& noise_mm) {
  Eigen::Index count = 0;
  for (const auto& used : mask) count += used.count();
  Residuals residuals;
  residuals.distance_mm.resize(count);
  residuals.sigma_mm.resize(count);
  residuals.place.resize(count, 3);
  residuals.q.resize(count, 2);
  residuals.pose.resize(count);
  residuals.point.resize(count);
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < mask.size(); ++m) {
    const SignedDistances& distances = prediction.poses[m].distances;
    for (Eigen::Index i = 0; i < mask[m].size(); ++i) {
      if (!mask[m][i]) continue;
      residuals.distance_mm[row] = distances.distance_mm[i];
      residuals.sigma_mm[row] = noise_mm[m];
      residuals.place.row(row) = prediction.poses[m].scan_points.row(i);
      residuals.q.row(row).setZero();
      for (int k = 0; k < 3; ++k)
        residuals.q.row(row) +=
            distances.closest.weight(i, k) * scene.anatomy->chart(distances.closest.node(i, k)).transpose();
      residuals.pose[row] = static_cast<int>(m);
      residuals.point[row++] = static_cast<int>(i);
    }
  }
  return residuals;
}

Eigen::VectorXd slope_at(Evaluator& evaluator, const simulation::Model& model, const Prediction& prediction,
                         const Residuals& residuals, const std::string& parameter,
                         const simulation::ChainDerivative& derivative) {
  std::vector<Eigen::VectorXd> by_pose;
  for (std::size_t m = 0; m < prediction.poses.size(); ++m)
    by_pose.push_back(evaluator.distance_derivative(model, prediction, m, parameter, derivative));
  Eigen::VectorXd slope(residuals.size());
  for (Eigen::Index r = 0; r < residuals.size(); ++r)
    slope[r] = by_pose[static_cast<std::size_t>(residuals.pose[r])][residuals.point[r]];
  return slope;
}

Eigen::VectorXd distance_change(const Prediction& prediction, const Residuals& residuals,
                                const std::vector<Points>& moves) {
  std::vector<Points> unit;
  for (const PosePrediction& pose : prediction.poses) unit.push_back(direction(pose.scan_points, pose.distances));
  Eigen::VectorXd change = Eigen::VectorXd::Zero(residuals.size());
  for (Eigen::Index r = 0; r < residuals.size(); ++r) {
    const auto m = static_cast<std::size_t>(residuals.pose[r]);
    if (moves[m].rows() == 0) continue;
    const ClosestPoints& closest = prediction.poses[m].distances.closest;
    const int i = residuals.point[r];
    for (int k = 0; k < 3; ++k)
      change[r] -= closest.weight(i, k) * moves[m].row(closest.node(i, k)).dot(unit[m].row(i));
  }
  return change;
}

Linearisation linearise(Evaluator& evaluator, const simulation::Sensitivities& sensitivities,
                        const FreeParameters& parameters, const Eigen::VectorXd& u, const Prediction& prediction,
                        const Residuals& residuals) {
  const simulation::Model model = parameters.model(u);
  const Eigen::VectorXd unit = parameters.slope(u);
  Linearisation result;
  result.slope.resize(residuals.size(), parameters.size());
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters.names()[static_cast<std::size_t>(i)];
    simulation::ChainDerivative derivative = sensitivities.of(name);
    result.slope.col(i) = unit[i] * slope_at(evaluator, model, prediction, residuals, name, derivative);
    derivative.X *= unit[i];
    derivative.prone *= unit[i];
    for (Points& x : derivative.poses) x *= unit[i];
    result.by_coordinate.push_back(std::move(derivative));
  }
  return result;
}

}  // namespace supine::calibration
