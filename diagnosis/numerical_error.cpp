// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/numerical_error.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "calibration/error_model.h"
#include "common/error.h"
#include "common/rms.h"
#include "diagnosis/other_mesh.h"
#include "diagnosis/weighted_fit.h"
#include "meshing/topology.h"
#include "simulation/solve/pushed_forward.h"

namespace supine::diagnosis {
namespace {

using calibration::Residuals;

constexpr double order_doubt = 0.3;     // of the change that quadratic elements make
constexpr double edge_share = 0.5;      // of the finer mesh's edges where skin and cut face meet
constexpr double triangle_share = 0.8;  // of the coarser surface

/// A field on the corners of linear tetrahedra as one on the nodes of quadratic ones of the same shapes.
Points on_quadratic(const meshing::TetMesh& quadratic, const Points& corners) {
  Points all(quadratic.points.rows(), 3);
  all.topRows(corners.rows()) = corners;
  for (Eigen::Index c = 0; c < quadratic.cells.rows(); ++c)
    for (int e = 0; e < 6; ++e)
      all.row(quadratic.cells(c, 4 + e)) = 0.5 * (corners.row(quadratic.cells(c, meshing::tet_edges[e][0])) +
                                                  corners.row(quadratic.cells(c, meshing::tet_edges[e][1])));
  return all;
}

simulation::ChainSolution on_quadratic(const meshing::TetMesh& quadratic, const simulation::ChainSolution& linear) {
  simulation::ChainSolution start;
  start.prone = on_quadratic(quadratic, linear.prone);
  start.X = on_quadratic(quadratic, linear.X);
  for (const simulation::PoseSolution& pose : linear.poses)
    start.poses.push_back({.name = pose.name, .x = on_quadratic(quadratic, pose.x), .report = {}});
  return start;
}

/// The quadratic solution that was found near, moved as the linear one moved since.
simulation::ChainSolution followed(const meshing::TetMesh& quadratic, const NumericalError& near,
                                   const simulation::ChainSolution& linear) {
  const auto moved = [&quadratic](const Points& from, const Points& then, const Points& now) {
    return Points(from + on_quadratic(quadratic, now - then));
  };
  simulation::ChainSolution start = near.finer;
  start.prone = moved(start.prone, near.given.prone, linear.prone);
  start.X = moved(start.X, near.given.X, linear.X);
  for (std::size_t p = 0; p < start.poses.size(); ++p)
    start.poses[p].x = moved(start.poses[p].x, near.given.poses[p].x, linear.poses[p].x);
  return start;
}

/// Enough for a change of tenths of a millimetre.
simulation::SolveOptions enough() {
  simulation::SolveOptions options;
  options.step_tolerance_mm = 0.02;  // the next Newton step is shorter many times over
  options.residual_tolerance = 3e-3;
  options.smallest_load_step = 0.125;  // a shape that is hard to reach is no measure of the mesh's error
  return options;
}

/// The same from a solution near by: where that leads nowhere, a load in steps takes minutes and ends nowhere as well.
simulation::SolveOptions enough_from_near() {
  simulation::SolveOptions options = enough();
  options.smallest_load_step = 1;
  return options;
}

/// The model on another mesh.
/// @param near  solution on @p mesh to start from, or nullptr
calibration::Prediction predicted_on(const calibration::MeasuredScene& scene, const meshing::TetMesh& mesh,
                                     const simulation::Model& model, const simulation::ChainSolution* near,
                                     const simulation::SolveOptions& options) {
  const meshing::Anatomy anatomy = meshing::compute_anatomy(mesh, scene.anatomy->side);
  calibration::MeasuredScene other = scene;
  other.mesh = &mesh;
  other.anatomy = &anatomy;
  calibration::Evaluator evaluator(other, model, options);
  return evaluator.predict(model, near);
}

/// Change of distance of the residuals' points. Points beyond the border of the other mesh keep theirs.
Eigen::VectorXd change_of(const Residuals& residuals, const calibration::Prediction& prediction) {
  Eigen::VectorXd change = Eigen::VectorXd::Zero(residuals.size());
  for (Eigen::Index r = 0; r < residuals.size(); ++r) {
    const auto& distances = prediction.poses[static_cast<std::size_t>(residuals.pose[r])].distances;
    const int point = residuals.point[r];
    if (!distances.closest.on_border[point]) change[r] = distances.distance_mm[point] - residuals.distance_mm[r];
  }
  return change;
}

/// Fills finer_mm and what it comes from.
/// @param near  or nullptr
void measure_finer(const calibration::MeasuredScene& scene, const simulation::Model& model, const calibration::Fit& fit,
                   const NumericalError* near, NumericalError& result) {
  if (scene.mesh->order() != 1) {
    const meshing::TetMesh mesh = other_mesh(*scene.mesh, *scene.anatomy, edge_share);
    result.finer_mm = change_of(fit.residuals, predicted_on(scene, mesh, model, nullptr, enough()));
    return;
  }
  const meshing::TetMesh mesh = meshing::to_quadratic(*scene.mesh);
  const simulation::ChainSolution& linear = fit.prediction.solution;
  const bool known = near != nullptr && near->finer.X.rows() == mesh.points.rows();
  const simulation::ChainSolution start = known ? followed(mesh, *near, linear) : on_quadratic(mesh, linear);
  calibration::Prediction finer = predicted_on(scene, mesh, model, &start, enough_from_near());
  result.finer_mm = change_of(fit.residuals, finer);
  result.model = model, result.given = linear, result.finer = std::move(finer.solution);
}

/// Root of a field of squares as seen around each point, over its root mean square: edges and folds err by more than
/// the mound. Nowhere under a half of it.
Eigen::VectorXd share_around(const Residuals& residuals, const Eigen::VectorXd& square) {
  constexpr double around_mm = 15, least = 0.25;
  if (!(square.mean() > 0)) return Eigen::VectorXd::Ones(residuals.size());
  const calibration::Clusters clusters = calibration::cluster_points(residuals, 450);
  const Eigen::VectorXd mean = clusters.means(square);
  Eigen::VectorXd around(mean.size());
  for (Eigen::Index i = 0; i < mean.size(); ++i) {
    double sum = 0, points = 0;
    for (Eigen::Index j = 0; j < mean.size(); ++j)
      if (clusters.pose[i] == clusters.pose[j] && (clusters.place.row(i) - clusters.place.row(j)).norm() < around_mm) {
        sum += clusters.members[j] * mean[j];
        points += clusters.members[j];
      }
    around[i] = std::max(sum / points, least * square.mean());
  }
  Eigen::VectorXd share(residuals.size());
  for (Eigen::Index r = 0; r < share.size(); ++r) share[r] = std::sqrt(around[clusters.of_point[r]]);
  return share / std::sqrt(mean_square(share));
}

/// Fills what follows from the two changes. @throws NumericalFailure  neither mesh gave an answer
void summarise(const calibration::MeasuredScene& scene, const Residuals& residuals, NumericalError& result) {
  const bool finer = result.finer_failure.empty(), coarser = result.coarser_failure.empty();
  if (!finer && !coarser)
    throw NumericalFailure("the error of the mesh cannot be measured: finer mesh: " + result.finer_failure +
                           "; coarser mesh: " + result.coarser_failure);
  result.finer_doubt = scene.mesh->order() == 1 ? order_doubt : 1;
  if (!finer) result.finer_mm = Eigen::VectorXd::Zero(residuals.size());
  if (!coarser) result.coarser_mm = Eigen::VectorXd::Zero(residuals.size());
  const double twice = finer && coarser ? 1 : 2;
  const Eigen::VectorXd square =
      std::pow(result.finer_doubt, 2) * result.finer_mm.cwiseAbs2() + result.coarser_mm.cwiseAbs2();
  result.spread_mm = std::sqrt(twice * square.mean());
  result.share = share_around(residuals, square);
  result.length_mm = 0.5 * twice *
                     ((finer ? correlation_length_mm(residuals, result.finer_mm) : 0) +
                      (coarser ? correlation_length_mm(residuals, result.coarser_mm) : 0));
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

NumericalError measure_numerical_error(const calibration::MeasuredScene& scene, const simulation::Model& model,
                                       const calibration::Fit& fit, const NumericalError* near) {
  NumericalError result;
#pragma omp parallel sections
  {
#pragma omp section
    try {
      measure_finer(scene, model, fit, near, result);
    } catch (const std::exception& failure) {
      result.finer_failure = failure.what();
    }
#pragma omp section
    try {
      const meshing::TetMesh mesh = coarser_mesh(*scene.mesh, *scene.anatomy, triangle_share);
      result.coarser_mm = change_of(fit.residuals, predicted_on(scene, mesh, model, nullptr, enough()));
    } catch (const std::exception& failure) {
      result.coarser_failure = failure.what();
    }
  }
  summarise(scene, fit.residuals, result);
  return result;
}

}  // namespace supine::diagnosis
