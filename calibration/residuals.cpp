// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/residuals.h"

#include <limits>

#include "meshing/anatomy.h"

namespace supine::calibration {

PointMask points_over_skin(const Prediction& prediction) {
  PointMask mask;
  for (const PosePrediction& pose : prediction.poses) mask.emplace_back(!pose.distances.closest.on_border);
  return mask;
}

namespace {

Residuals sized(Eigen::Index count, Eigen::Index landmark_rows) {
  Residuals residuals;
  residuals.distance_mm.resize(count);
  residuals.sigma_mm.resize(count);
  residuals.place.resize(count, 3);
  residuals.on_skin.resize(count, 3);
  residuals.q.resize(count, 2);
  residuals.pose.resize(count);
  residuals.point.resize(count);
  residuals.landmark_rows = landmark_rows;
  return residuals;
}

/// Anatomy coordinates of the scan point of the pose that lies closest; those of the chart's centre where none is.
Eigen::RowVector2d chart_of_closest(const Residuals& residuals, int pose, const Eigen::RowVector3d& place) {
  Eigen::RowVector2d q = Eigen::RowVector2d::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index r = 0; r < residuals.skin_rows(); ++r) {
    const double square = (residuals.place.row(r) - place).squaredNorm();
    if (residuals.pose[r] == pose && square < least) least = square, q = residuals.q.row(r);
  }
  return q;
}

void add_landmarks(const MeasuredScene& scene, const Prediction& prediction, Residuals& residuals) {
  Eigen::Index row = residuals.skin_rows();
  for (std::size_t m = 0; m < prediction.poses.size(); ++m) {
    const LandmarkPrediction& landmarks = prediction.poses[m].landmarks;
    for (Eigen::Index l = 0; l < landmarks.measured.rows(); ++l)
      for (int axis = 0; axis < 3; ++axis, ++row) {
        residuals.distance_mm[row] = landmarks.measured(l, axis) - landmarks.predicted(l, axis);
        residuals.sigma_mm[row] = scene.landmarks[m]->sigma_mm[l];
        residuals.place.row(row) = landmarks.measured.row(l);
        residuals.on_skin.row(row) = landmarks.predicted.row(l);
        residuals.q.row(row) = chart_of_closest(residuals, static_cast<int>(m), landmarks.measured.row(l));
        residuals.pose[row] = static_cast<int>(m);
        residuals.point[row] = static_cast<int>(3 * l) + axis;
      }
  }
}

}  // namespace

Residuals Residuals::skin() const {
  const Eigen::Index rows = skin_rows();
  return {skin_mm(),       sigma_mm.head(rows), place.topRows(rows), on_skin.topRows(rows),
          q.topRows(rows), pose.head(rows),     point.head(rows)};
}

Residuals residuals_of(const MeasuredScene& scene, const Prediction& prediction, const PointMask& mask,
                       const std::vector<double>& noise_mm) {
  Eigen::Index points = 0, landmarks = 0;
  for (const auto& used : mask) points += used.count();
  for (const PosePrediction& pose : prediction.poses) landmarks += pose.landmarks.measured.rows();
  Residuals residuals = sized(points + 3 * landmarks, 3 * landmarks);
  Eigen::Index row = 0;
  for (std::size_t m = 0; m < mask.size(); ++m) {
    const SignedDistances& distances = prediction.poses[m].distances;
    for (Eigen::Index i = 0; i < mask[m].size(); ++i) {
      if (!mask[m][i]) continue;
      residuals.distance_mm[row] = distances.distance_mm[i];
      residuals.sigma_mm[row] = noise_mm[m];
      residuals.place.row(row) = prediction.poses[m].scan_points.row(i);
      residuals.on_skin.row(row) = distances.closest.point.row(i);
      residuals.q.row(row).setZero();
      for (Eigen::Index k = 0; k < distances.closest.node.cols(); ++k)
        residuals.q.row(row) +=
            distances.closest.weight(i, k) * scene.anatomy->chart(distances.closest.node(i, k)).transpose();
      residuals.pose[row] = static_cast<int>(m);
      residuals.point[row++] = static_cast<int>(i);
    }
  }
  add_landmarks(scene, prediction, residuals);
  return residuals;
}

Eigen::VectorXd slope_at(Evaluator& evaluator, const simulation::Model& model, const Prediction& prediction,
                         const Residuals& residuals, const std::string& parameter,
                         const simulation::ChainDerivative& derivative) {
  std::vector<Eigen::VectorXd> by_pose;
  std::vector<Points> landmarks(prediction.poses.size());
  for (std::size_t m = 0; m < prediction.poses.size(); ++m) {
    by_pose.push_back(evaluator.distance_derivative(model, prediction, m, parameter, derivative));
    if (prediction.poses[m].landmarks.in)
      landmarks[m] = evaluator.landmark_derivative(model, prediction, m, parameter, derivative);
  }
  Eigen::VectorXd slope(residuals.size());
  for (Eigen::Index r = 0; r < residuals.size(); ++r) {
    const auto m = static_cast<std::size_t>(residuals.pose[r]);
    const int point = residuals.point[r];
    slope[r] = residuals.is_landmark(r) ? landmarks[m](point / 3, point % 3) : by_pose[m][point];
  }
  return slope;
}

Eigen::VectorXd distance_change(const Prediction& prediction, const Residuals& residuals,
                                const std::vector<Points>& moves) {
  std::vector<Points> unit, landmarks(prediction.poses.size());
  for (std::size_t m = 0; m < prediction.poses.size(); ++m) {
    const PosePrediction& pose = prediction.poses[m];
    unit.push_back(direction(pose.scan_points, pose.distances));
    if (pose.landmarks.in && moves[m].rows() > 0) landmarks[m] = pose.landmarks.in->at(moves[m]);
  }
  Eigen::VectorXd change = Eigen::VectorXd::Zero(residuals.size());
  for (Eigen::Index r = 0; r < residuals.size(); ++r) {
    const auto m = static_cast<std::size_t>(residuals.pose[r]);
    if (moves[m].rows() == 0) continue;
    const ClosestPoints& closest = prediction.poses[m].distances.closest;
    const int i = residuals.point[r];
    if (residuals.is_landmark(r)) {
      change[r] = -landmarks[m](i / 3, i % 3);
      continue;
    }
    for (Eigen::Index k = 0; k < closest.node.cols(); ++k)
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
  std::vector<simulation::ChainDerivative> derivatives = sensitivities.of(parameters.names());
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters.names()[static_cast<std::size_t>(i)];
    simulation::ChainDerivative& derivative = derivatives[static_cast<std::size_t>(i)];
    result.slope.col(i) = unit[i] * slope_at(evaluator, model, prediction, residuals, name, derivative);
    derivative.X *= unit[i];
    derivative.prone *= unit[i];
    for (Points& x : derivative.poses) x *= unit[i];
    result.by_coordinate.push_back(std::move(derivative));
  }
  return result;
}

}  // namespace supine::calibration
