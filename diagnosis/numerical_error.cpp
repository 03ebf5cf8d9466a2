// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/numerical_error.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "calibration/error_model.h"
#include "common/error.h"
#include "common/rms.h"
#include "common/side_by_side.h"
#include "diagnosis/creases.h"
#include "diagnosis/other_mesh.h"
#include "diagnosis/weighted_fit.h"
#include "meshing/topology.h"
#include "simulation/embedding.h"

namespace supine::diagnosis {
namespace {

using calibration::Residuals;

constexpr double order_doubt = 0.3;          // of the change that quadratic elements make
constexpr double scaled_doubt = 0.8;         // of that on a coarser mesh, scaled
constexpr double edge_share = 0.5;           // of the finer mesh's edges where skin and cut face meet
constexpr double triangle_share = 0.8;       // of the coarser surface of a quadratic mesh
constexpr double few_triangles_share = 0.5;  // of the mesh for both orders

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
  simulation::ChainSolution start = near.quadratic;
  start.prone = moved(start.prone, near.linear.prone, linear.prone);
  start.X = moved(start.X, near.linear.X, linear.X);
  for (std::size_t p = 0; p < start.poses.size(); ++p)
    start.poses[p].x = moved(start.poses[p].x, near.linear.poses[p].x, linear.poses[p].x);
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

/// The same without a detour.
simulation::SolveOptions enough_straight() {
  simulation::SolveOptions options = enough_from_near();
  options.max_iterations = 14;
  options.progress = [before = std::string()](const std::string& what, double, int iteration, double) mutable {
    if (iteration > 0) return;
    if (what == before)
      throw NumericalFailure(what + ": quadratic elements have no equilibrium near that of the linear ones");
    before = what;
  };
  return options;
}

/// The model on another mesh.
/// @param near  solution on @p mesh to start from, or nullptr
calibration::Prediction predicted_on(const calibration::MeasuredScene& scene, const meshing::TetMesh& mesh,
                                     const simulation::Model& model, const simulation::ChainSolution* near,
                                     const simulation::SolveOptions& options) {
  const meshing::Anatomy anatomy = meshing::compute_anatomy(mesh, scene.anatomy->side, scene.anatomy->imaged_pose);
  calibration::MeasuredScene other = scene;
  other.mesh = &mesh;
  other.anatomy = &anatomy;
  calibration::Evaluator evaluator(other, model, options);
  return evaluator.predict(model, near);
}

/// Distance of the residuals' points; NaN beyond the border of the mesh it was found on.
Eigen::VectorXd distances_of(const Residuals& residuals, const calibration::Prediction& prediction) {
  Eigen::VectorXd there(residuals.size());
  for (Eigen::Index r = 0; r < residuals.size(); ++r) {
    const calibration::PosePrediction& pose = prediction.poses[static_cast<std::size_t>(residuals.pose[r])];
    const auto& distances = pose.distances;
    const auto& landmarks = pose.landmarks;
    const int point = residuals.point[r];
    if (residuals.is_landmark(r)) {
      there[r] = landmarks.measured(point / 3, point % 3) - landmarks.predicted(point / 3, point % 3);
      continue;
    }
    there[r] = distances.closest.on_border[point] ? std::nan("") : distances.distance_mm[point];
  }
  return there;
}

/// b − a; zero where either says nothing.
Eigen::VectorXd change(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return (b - a).unaryExpr([](double d) { return std::isnan(d) ? 0.0 : d; });
}

/// What @p measure says, or into @p failure why it says nothing.
template <class Measure>
void attempt(std::string& failure, Measure measure) {
  try {
    measure();
  } catch (const std::exception& why) {
    failure = why.what();
  }
}

/// Quadratic elements on the cells of @p mesh, from its linear solution in @p result and what was found before.
calibration::Prediction quadratic_on(const calibration::MeasuredScene& scene, const meshing::TetMesh& mesh,
                                     const simulation::Model& model, const NumericalError* near,
                                     const NumericalError& result, const simulation::SolveOptions& options) {
  const meshing::TetMesh quadratic = meshing::to_quadratic(mesh);
  const bool followable = near != nullptr && near->quadratic.X.rows() == quadratic.points.rows();
  const simulation::ChainSolution start =
      followable ? followed(quadratic, *near, result.linear) : on_quadratic(quadratic, result.linear);
  return predicted_on(scene, quadratic, model, &start, options);
}

/// Fills finer_mm, coarser_mm and where they come from by quadratic elements of the given tetrahedra.
void measure_on_given(const calibration::MeasuredScene& scene, const simulation::Model& model,
                      const calibration::Fit& fit, const NumericalError* near, NumericalError& result) {
  const Eigen::VectorXd& given = fit.residuals.distance_mm;
  result.linear = fit.prediction.solution;
  calibration::Prediction finer = quadratic_on(scene, *scene.mesh, model, near, result, enough_straight());
  result.finer_mm = change(given, distances_of(fit.residuals, finer));
  result.finer_doubt = order_doubt;
  result.quadratic = std::move(finer.solution);
  attempt(result.coarser_failure, [&] {
    const meshing::TetMesh mesh = coarser_mesh(*scene.mesh, *scene.anatomy, triangle_share);
    const calibration::Prediction coarser = predicted_on(scene, mesh, model, nullptr, enough());
    result.coarser_mm = change(given, distances_of(fit.residuals, coarser));
  });
}

/// The same by both orders on a coarser mesh.
void measure_on_coarse(const calibration::MeasuredScene& scene, const simulation::Model& model,
                       const calibration::Fit& fit, const NumericalError* near, NumericalError& result) {
  const bool known = near != nullptr && near->coarse;
  result.coarse =
      known ? near->coarse
            : std::make_shared<const meshing::TetMesh>(coarser_mesh(*scene.mesh, *scene.anatomy, few_triangles_share));
  calibration::Prediction linear = predicted_on(scene, *result.coarse, model,
                                                known && near->linear.X.rows() > 0 ? &near->linear : nullptr, enough());
  const Eigen::VectorXd given = fit.residuals.distance_mm, l = distances_of(fit.residuals, linear);
  result.linear = std::move(linear.solution);
  result.coarser_mm = change(given, l);
  result.finer_doubt = scaled_doubt;
  calibration::Prediction finer =
      quadratic_on(scene, *result.coarse, model, known ? near : nullptr, result, enough_from_near());
  const Eigen::VectorXd order = change(l, distances_of(fit.residuals, finer));
  result.quadratic = std::move(finer.solution);
  const double r =
      std::cbrt(static_cast<double>(result.coarse->cells.rows()) / static_cast<double>(scene.mesh->cells.rows()));
  result.finer_mm = r * order;
  result.coarser_mm = (result.coarser_mm + (1 - r) * order) / std::max(1.0, 1 / (r * r) - 1);
}

/// The same for linear elements.
void measure_of_linear(const calibration::MeasuredScene& scene, const simulation::Model& model,
                       const calibration::Fit& fit, const NumericalError* near, NumericalError& result) {
  if (near == nullptr || !near->coarse) try {
      return measure_on_given(scene, model, fit, near, result);
    } catch (const NumericalFailure&) {
      result = {};  // the coarser mesh then
    }
  measure_on_coarse(scene, model, fit, near, result);
}

/// The shapes of a solution on the nodes of another mesh of the same body.
simulation::ChainSolution carried(const simulation::ChainSolution& solution, const meshing::TetMesh& from,
                                  const meshing::TetMesh& to) {
  const simulation::Embedding nodes(from, to.points);
  simulation::ChainSolution there;
  there.prone = nodes.at(solution.prone);
  there.X = nodes.at(solution.X);
  for (const simulation::PoseSolution& pose : solution.poses)
    there.poses.push_back({.name = pose.name, .x = nodes.at(pose.x), .report = {}});
  return there;
}

/// Shapes moved by what others have moved since then.
simulation::ChainSolution moved(simulation::ChainSolution shapes, const simulation::ChainSolution& then,
                                const simulation::ChainSolution& now) {
  shapes.prone += now.prone - then.prone;
  shapes.X += now.X - then.X;
  for (std::size_t p = 0; p < shapes.poses.size(); ++p) shapes.poses[p].x += now.poses[p].x - then.poses[p].x;
  return shapes;
}

/// What another mesh changes, and the model on it.
/// @param near  the same of a similar model: its mesh, in place of the one that @p make makes, and where to start from,
///   as far as the body has not moved since. Either may be missing: the mesh was not made, or the model had no
///   equilibrium on it
template <class Make>
Eigen::VectorXd change_on(const calibration::MeasuredScene& scene, const simulation::Model& model,
                          const calibration::Fit& fit, const NumericalError::OnOther* near, int most_work, Make make,
                          NumericalError::OnOther& result) {
  const bool known = near != nullptr && near->mesh;
  result.mesh = known ? near->mesh : std::make_shared<const meshing::TetMesh>(make());
  result.given = carried(fit.prediction.solution, *scene.mesh, *result.mesh);
  const simulation::ChainSolution start =
      known && near->solution.X.rows() > 0 ? moved(near->solution, near->given, result.given) : result.given;
  simulation::SolveOptions options = enough();
  options.most_work = most_work;
  calibration::Prediction there = predicted_on(scene, *result.mesh, model, &start, options);
  result.solution = std::move(there.solution);
  return change(fit.residuals.distance_mm, distances_of(fit.residuals, there));
}

/// The same for quadratic ones, on two meshes side by side.
void measure_on_two(const calibration::MeasuredScene& scene, const simulation::Model& model,
                    const calibration::Fit& fit, const NumericalError* near, int most_work, NumericalError& result) {
  const auto finer = [&] {
    const auto make = [&] { return other_mesh(*scene.mesh, edge_share); };
    result.finer_mm = change_on(scene, model, fit, near ? &near->on_finer : nullptr, most_work, make, result.on_finer);
  };
  const auto coarser = [&] {
    const auto make = [&] { return coarser_mesh(*scene.mesh, *scene.anatomy, triangle_share); };
    result.coarser_mm =
        change_on(scene, model, fit, near ? &near->on_coarser : nullptr, most_work, make, result.on_coarser);
  };
  side_by_side({[&] { attempt(result.finer_failure, finer); }, [&] { attempt(result.coarser_failure, coarser); }});
}

/// Root of a field of squares as seen around each point, over its root mean square where @p counts: edges err by more
/// than the mound. Nowhere under a half of it.
Eigen::VectorXd share_around(const Residuals& residuals, const Eigen::VectorXd& square, const Eigen::VectorXd& counts) {
  constexpr double around_mm = 15, least = 0.25;
  const double mean_square = square.dot(counts) / counts.sum();
  if (!(mean_square > 0)) return Eigen::VectorXd::Ones(residuals.size());
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
    around[i] = std::max(sum / points, least * mean_square);
  }
  Eigen::VectorXd share(residuals.size());
  for (Eigen::Index r = 0; r < share.size(); ++r) share[r] = std::sqrt(around[clusters.of_point[r]]);
  return share / std::sqrt(share.cwiseAbs2().dot(counts) / counts.sum());
}

/// Fills what follows from the two changes. Creases stand in the errors by themselves (creases.h): what they do
/// otherwise on another mesh says nothing of the rest of the skin.
void summarise(const calibration::MeasuredScene& scene, const calibration::Fit& fit, NumericalError& result) {
  constexpr double unknown_length_mm = 25;
  const Residuals& residuals = fit.residuals;
  const bool finer = result.finer_failure.empty(), coarser = result.coarser_failure.empty();
  if (!finer) result.finer_mm = Eigen::VectorXd::Zero(residuals.size());
  if (!coarser) result.coarser_mm = Eigen::VectorXd::Zero(residuals.size());
  Eigen::VectorXd smooth = (crease_error(scene, fit.prediction, residuals).sd_mm.array() == 0).cast<double>();
  if (!(smooth.sum() > 0)) smooth.setOnes();
  const Eigen::VectorXd finer_there = result.finer_mm.cwiseProduct(smooth);
  const Eigen::VectorXd coarser_there = result.coarser_mm.cwiseProduct(smooth);
  const Eigen::VectorXd square = std::pow(result.finer_doubt, 2) * finer_there.cwiseAbs2() + coarser_there.cwiseAbs2();
  result.spread_mm = std::sqrt(square.sum() / smooth.sum());
  result.share = share_around(residuals, square, smooth);
  if (finer && coarser) {
    result.length_mm =
        0.5 * (correlation_length_mm(residuals, finer_there) + correlation_length_mm(residuals, coarser_there));
    return;
  }
  result.length_mm = unknown_length_mm;
  result.spread_mm = std::max(result.spread_mm, largest_share_of_way * way_mm(fit.prediction.solution));
}

}  // namespace

double way_mm(const simulation::ChainSolution& solution) {
  const Points way = solution.poses[0].x - solution.prone;
  return std::sqrt(way.squaredNorm() / static_cast<double>(way.rows()));
}

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
      if (!clusters.related(i, j) || r < near_mm || r > far_mm) continue;
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
                                       const calibration::Fit& fit, const NumericalError* near, int most_work) {
  NumericalError result;
  if (scene.mesh->order() == 1)
    attempt(result.finer_failure, [&] { measure_of_linear(scene, model, fit, near, result); });
  else
    measure_on_two(scene, model, fit, near, most_work, result);
  if (result.coarser_mm.size() == 0 && result.coarser_failure.empty()) result.coarser_failure = result.finer_failure;
  summarise(scene, fit, result);
  return result;
}

}  // namespace supine::diagnosis
