// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/evaluator.h"

#include <cmath>

namespace supine::calibration {
namespace {

/// Points that say nothing: no distance is taken from them, nor to what they are a corner of.
void leave_out(const std::vector<int>& points, PosePrediction& pose) {
  if (points.empty()) return;
  std::vector<bool> out(static_cast<std::size_t>(pose.scan_points.rows()), false);
  for (const int point : points) {
    pose.distances.closest.on_border[point] = true;
    out[static_cast<std::size_t>(point)] = true;
  }
  const ClosestPoints& closest = pose.to_scan.to_scan.closest;
  for (Eigen::Index i = 0; i < closest.node.rows(); ++i)
    for (Eigen::Index k = 0; k < closest.node.cols(); ++k)
      if (closest.weight(i, k) > 0 && out[static_cast<std::size_t>(closest.node(i, k))])
        pose.to_scan.covered[i] = false;
}

std::vector<simulation::PoseLoad> loads_of(const MeasuredScene& scene) {
  std::vector<simulation::PoseLoad> loads = {scene.prone};
  for (const Measurement* measurement : scene.measurements) loads.push_back(measurement->pose);
  return loads;
}

}  // namespace

double Prediction::mae_study_mm() const {
  double sum = 0;
  Eigen::Index count = 0;
  for (const PosePrediction& pose : poses) {
    const auto& covered = pose.to_scan.covered;
    for (Eigen::Index i = 0; i < covered.size(); ++i)
      if (covered[i]) sum += std::abs(pose.to_scan.to_scan.distance_mm[i]);
    count += covered.count();
  }
  return sum / static_cast<double>(count);
}

std::vector<double> Prediction::scan_distances() const {
  std::vector<double> distances;
  for (const PosePrediction& pose : poses)
    for (Eigen::Index i = 0; i < pose.distances.distance_mm.size(); ++i)
      if (!pose.distances.closest.on_border[i]) distances.push_back(pose.distances.distance_mm[i]);
  return distances;
}

Evaluator::Evaluator(MeasuredScene scene, const simulation::Model& model, const simulation::SolveOptions& options)
    : scene_(std::move(scene)), chain_(*scene_.mesh, *scene_.anatomy, model, loads_of(scene_), options) {
  scene_.landmarks.resize(scene_.measurements.size(), nullptr);
  for (std::size_t m = 0; m < scene_.measurements.size(); ++m) {
    skins_.emplace_back(*scene_.mesh, scene_.mesh->points);
    landmarks_.push_back(scene_.landmarks[m] == nullptr ? nullptr
                                                        : std::make_shared<const simulation::Embedding>(
                                                              *scene_.mesh, scene_.landmarks[m]->imaged));
  }
}

Prediction Evaluator::predict(const simulation::Model& model, const simulation::ChainSolution* near) {
  Prediction prediction;
  prediction.solution = chain_.solve(model, near);
  prediction.poses.resize(scene_.measurements.size());
  for (std::size_t m = 0; m < scene_.measurements.size(); ++m) {
    const Scan& scan = scene_.measurements[m]->scan;
    PosePrediction& pose = prediction.poses[m];
    skins_[m].move(prediction.solution.poses[m].x);
    const auto fields = simulation::values_of(chain_.fields(model, scene_.measurements[m]->pose));
    const ScanMotion motion(fields.scan_motion, scan.points());
    pose.scan_points = motion.corrected(scan.points());
    scan_to_model(skins_[m], pose.scan_points, pose.distances);
    model_to_scan(scan, motion.as_given(skins_[m].node_points()), motion.directions_as_given(skins_[m].node_normals()),
                  {}, pose.to_scan);
    leave_out(scene_.measurements[m]->left_out, pose);
    if (landmarks_[m])
      pose.landmarks = {motion.corrected(scene_.landmarks[m]->measured),
                        landmarks_[m]->at(prediction.solution.poses[m].x), landmarks_[m]};
  }
  return prediction;
}

Eigen::VectorXd Evaluator::distance_derivative(const simulation::Model& model, const Prediction& prediction,
                                               std::size_t pose, const std::string& parameter,
                                               const simulation::ChainDerivative& derivative) {
  const PosePrediction& state = prediction.poses[pose];
  const ClosestPoints& closest = state.distances.closest;
  const Points unit = direction(state.scan_points, state.distances);
  const Points& skin = derivative.poses[pose];
  const auto fields = chain_.fields(model, scene_.measurements[pose]->pose, parameter);
  Points scan = Points::Zero(unit.rows(), 3);
  if (!simulation::derivatives_of(fields).scan_motion.isZero(0))
    scan = corrected_derivative(fields.scan_motion, scene_.measurements[pose]->scan.points(),
                                scene_.measurements[pose]->scan.points());
  Eigen::VectorXd slope(unit.rows());
  for (Eigen::Index i = 0; i < unit.rows(); ++i) {
    Eigen::RowVector3d moved = scan.row(i);
    for (Eigen::Index k = 0; k < closest.node.cols(); ++k) moved -= closest.weight(i, k) * skin.row(closest.node(i, k));
    slope[i] = moved.dot(unit.row(i));
  }
  return slope;
}

Points Evaluator::landmark_derivative(const simulation::Model& model, const Prediction& prediction, std::size_t pose,
                                      const std::string& parameter, const simulation::ChainDerivative& derivative) {
  Points moved = -prediction.poses[pose].landmarks.in->at(derivative.poses[pose]);
  const auto fields = chain_.fields(model, scene_.measurements[pose]->pose, parameter);
  if (!simulation::derivatives_of(fields).scan_motion.isZero(0))
    moved += corrected_derivative(fields.scan_motion, scene_.measurements[pose]->scan.points(),
                                  scene_.landmarks[pose]->measured);
  return moved;
}

void move_along(const simulation::ChainDerivative& derivative, double step, simulation::ChainSolution& solution) {
  solution.X += step * derivative.X;
  solution.prone += step * derivative.prone;
  for (std::size_t p = 0; p < solution.poses.size(); ++p) solution.poses[p].x += step * derivative.poses[p];
}

simulation::ChainSolution extrapolated(const simulation::ChainSolution& solution,
                                       const std::vector<simulation::ChainDerivative>& by_coordinate,
                                       const Eigen::VectorXd& step) {
  simulation::ChainSolution moved = solution;
  for (std::size_t i = 0; i < by_coordinate.size(); ++i)
    move_along(by_coordinate[i], step[static_cast<Eigen::Index>(i)], moved);
  return moved;
}

}  // namespace supine::calibration
