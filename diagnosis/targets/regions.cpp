// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/regions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calibration/model_skin.h"
#include "common/error.h"
#include "common/statistics.h"
#include "diagnosis/evidence/discrepancy.h"
#include "diagnosis/evidence/field_modes.h"
#include "diagnosis/evidence/nuisance_words.h"
#include "diagnosis/further_poses.h"
#include "diagnosis/targets/further_scan.h"
#include "diagnosis/targets/places.h"
#include "meshing/topology.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Of a mesh whose error was not measured in the pose: 4.5 % of the way in the median of sixteen computed breasts
// (docs/diagnosis.md), spread over three axes.
const double mesh_share_of_way = 0.045 / std::sqrt(3.0);
constexpr double marker_mm = 1.5;  // of a marker's place, each axis; as of landmarks that state no sigma_mm
constexpr std::size_t most_told = 6;
constexpr double open_sd = 3;  // coordinates of a parameter without prior, as in directions_at()

/// Nuisances of the pose that no measured pose has.
std::vector<Nuisance> with_those_of(const simulation::Model& model, std::vector<Nuisance> known,
                                    const std::string& imaged, const std::string& pose, const Priors& priors) {
  for (const Nuisance& nuisance : known)
    if (nuisance.pose == pose) return known;
  for (Nuisance& nuisance : nuisances_of(model, {imaged, pose}, priors))
    if (nuisance.pose == pose) known.push_back(std::move(nuisance));
  return known;
}

MatrixXd beyond_forces(const Points& places) {
  const MatrixXd plain = gaussian_kernel(places, places, beyond_forces_length_mm);
  MatrixXd all = MatrixXd::Zero(3 * places.rows(), 3 * places.rows());
  for (Index i = 0; i < plain.rows(); ++i)
    for (Index j = 0; j < plain.cols(); ++j)
      for (int a = 0; a < 3; ++a) all(3 * i + a, 3 * j + a) = share_beyond_forces * plain(i, j);
  return all;
}

/// Errors of the mesh: alike for places close to each other.
MatrixXd mesh_errors(const Points& places, double sd_mm, double length_mm) {
  MatrixXd all = MatrixXd::Zero(3 * places.rows(), 3 * places.rows());
  for (Index i = 0; i < places.rows(); ++i)
    for (Index j = 0; j < places.rows(); ++j)
      for (int a = 0; a < 3; ++a)
        all(3 * i + a, 3 * j + a) = sd_mm * sd_mm * std::exp(-(places.row(i) - places.row(j)).norm() / length_mm);
  return all;
}

void fill_targets(JointMoves& joint, const PointMoves& moves, const Points& places) {
  joint.targets.resize(moves.parameters.rows(), moves.parameters.cols() + moves.nuisances.cols());
  joint.targets << moves.parameters, moves.nuisances;
  joint.target_patches = moves.patches;
  joint.target_kernel = moves.forces * moves.forces.transpose() + beyond_forces(places);
}

Depth depth_of(const Vector3d& target, const Vector3d& skin, const Vector3d& normal, const Vector3d& way,
               const Eigen::Matrix<double, 6, 6>& covariance) {
  // Both move: the length along the way changes by n·(skin − target) / n·way.
  Eigen::Matrix<double, 6, 1> slope;
  slope << -normal, normal;
  slope /= normal.dot(way);
  return {skin, (skin - target).dot(way), std::sqrt(std::max(0.0, slope.dot(covariance * slope)))};
}

/// Share of the variances of a target that goes with what is known of something else.
double gone(const MatrixXd& cross, const MatrixXd& other, const Matrix3d& own) {
  return (cross * other.ldlt().solve(cross.transpose())).trace() / own.trace();
}

std::vector<Shrink> shrinks_of(const ConditionedTargets& known, const std::vector<std::string>& names, Index row,
                               Index skin_row) {
  const Matrix3d own = known.covariance.block<3, 3>(row, row);
  std::vector<Shrink> all;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto column = static_cast<Index>(k);
    const double variance = known.directions_covariance(column, column);
    if (variance <= 0) continue;
    const Vector3d cross = known.with_directions.col(column).segment<3>(row);
    all.push_back({names[k], "knowing " + words_of(names[k]), cross.squaredNorm() / variance / own.trace()});
  }
  const Matrix3d marker =
      known.covariance.block<3, 3>(skin_row, skin_row) + marker_mm * marker_mm * Matrix3d::Identity();
  all.push_back({"marker on the nearest skin", "a marker on the nearest skin",
                 gone(known.covariance.block<3, 3>(row, skin_row), marker, own)});
  return all;
}

void keep_most(std::vector<Shrink>& all) {
  std::stable_sort(all.begin(), all.end(), [](const Shrink& a, const Shrink& b) { return a.share > b.share; });
  all.resize(std::min(all.size(), most_told));
}

/// Six rows of two points.
Eigen::Matrix<double, 6, 6> of_two(const MatrixXd& covariance, Index a, Index b) {
  Eigen::Matrix<double, 6, 6> both;
  both << covariance.block<3, 3>(a, a), covariance.block<3, 3>(a, b), covariance.block<3, 3>(b, a),
      covariance.block<3, 3>(b, b);
  return both;
}

TargetRegions told(const TargetQuestion& question, const Places& places, const ConditionedTargets& known,
                   const std::vector<std::string>& names) {
  const Index count = question.imaged.rows();
  const Eigen::VectorXd outside = simulation::Embedding(*question.mesh, question.imaged).outside_mm();
  const Points moved = places.there + Eigen::Map<const Points>(known.mean.data(), 3 * count, 3);
  const double reach = std::sqrt(chi_squared_quantile(3, 0.95));
  TargetRegions regions;
  regions.covariance = known.covariance.topLeftCorner(3 * count, 3 * count);
  regions.parameters.mean = known.directions_mean, regions.parameters.covariance = known.directions_covariance;
  for (Index p = 0; p < count; ++p) {
    TargetRegion region;
    region.name = question.names[static_cast<std::size_t>(p)];
    region.model_mm = places.there.row(p), region.place_mm = moved.row(p), region.outside_mm = outside[p];
    region.finer_mm.setZero();
    region.covariance = known.covariance.block<3, 3>(3 * p, 3 * p);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(region.covariance);
    if (!(eigen.eigenvalues()[0] > 0))
      throw NumericalFailure("the covariance of " + region.name +
                             " is not positive: the shape in the pose is not the one that the scan was fitted with");
    region.half_axes_mm = reach * eigen.eigenvalues().cwiseSqrt().reverse();
    region.axes = eigen.eigenvectors().rowwise().reverse();
    const Index near = count + p, over = 2 * count + p;
    const auto k = static_cast<std::size_t>(p);
    region.nearest = depth_of(region.place_mm, moved.row(near), places.normal[k], places.normal[k],
                              of_two(known.covariance, 3 * p, 3 * near));
    if (places.has_straight[k] && places.straight_normal[k].dot(question.pose.gravity) < -0.1)
      region.straight = depth_of(region.place_mm, moved.row(over), places.straight_normal[k], -question.pose.gravity,
                                 of_two(known.covariance, 3 * p, 3 * over));
    region.shrinks = shrinks_of(known, names, 3 * p, 3 * near);
    regions.points.push_back(std::move(region));
  }
  return regions;
}

/// Rows of the clusters that are landmarks of one pose.
std::vector<int> landmark_rows(const calibration::Clusters& clusters, int pose) {
  std::vector<int> rows;
  for (Index i = 0; i < clusters.kind.size(); ++i)
    if (clusters.kind[i] > 0 && clusters.pose[i] == pose) rows.push_back(static_cast<int>(i));
  return rows;
}

int row_of_pose(const calibration::MeasuredScene& scene, const std::string& pose) {
  for (std::size_t m = 0; m < scene.measurements.size(); ++m)
    if (scene.measurements[m]->pose.name == pose) return static_cast<int>(m);
  return -1;
}

/// What was measured, as the base fit has it.
JointMoves measured_part(calibration::Evaluator& evaluator, const BaseFit& base, const Priors& priors,
                         const std::vector<Nuisance>& nuisances, Discrepancy& discrepancy) {
  const simulation::Sensitivities at_data(evaluator.chain(), base.model, base.fit.prediction.solution);
  const calibration::Residuals& residuals = base.fit.residuals;
  discrepancy = discrepancy_of(*evaluator.scene().mesh, at_data, base.fit.prediction, residuals, base.clusters);
  const Directions all = directions_at(base.fit, *base.parameters, base.nuisances, base.clusters);
  const auto z = base.fit.u.size() + static_cast<Index>(nuisances.size()), n = all.columns.rows();
  JointMoves joint;
  // Those of the pose alone move no measured distance.
  joint.data = MatrixXd::Zero(n, z), joint.mean = VectorXd::Zero(z), joint.sd = VectorXd::Ones(z);
  joint.data.leftCols(all.size()) = all.columns;
  joint.mean.head(all.size()) = all.mean, joint.sd.head(all.size()) = all.sd;
  joint.y = base.distances(residuals);
  joint.data_patches = base.clusters.means(
      patchiness_shapes(evaluator.chain(), at_data, base.fit.prediction, residuals, priors.patchiness));
  // The fit took both where it began; distances and targets must be moved by the same ones.
  joint.data_errors =
      base.errors - base.patches * base.patches.transpose() + joint.data_patches * joint.data_patches.transpose();
  joint.data_kernel = discrepancy.kernel;
  const LinearEvidence evidence(*base.covariance, joint.y, all);
  std::vector<int> every(static_cast<std::size_t>(all.size()));
  std::iota(every.begin(), every.end(), 0);
  joint.sizes_mm = base.covariance->sizes_mm(), joint.size_probability = evidence.weigh(every).size_probability;
  return joint;
}

std::vector<std::string> names_of(const FreeParameters& free, const std::vector<Nuisance>& nuisances) {
  std::vector<std::string> names = free.names();
  for (const Nuisance& nuisance : nuisances) names.push_back(nuisance.name());
  return names;
}

/// What finer elements move the places by, as far as that was measured; zero else. Most of it is a slide along the
/// muscle that the scan hardly shows, and it did not bring places nearer to the truth (docs/verification.md): an error
/// of all places together, no correction.
VectorXd moved_by_finer_elements(const TargetQuestion& question, const Places& places, const BaseFit& base) {
  VectorXd moved = VectorXd::Zero(places.imaged.size());
  if (!base.numerical || !base.numerical->finer_failure.empty()) return moved;
  const NumericalError& error = *base.numerical;
  for (std::size_t p = 0; p < error.quadratic.poses.size(); ++p) {
    if (error.quadratic.poses[p].name != question.pose.name) continue;
    const meshing::TetMesh& mesh = error.coarse ? *error.coarse : *question.mesh;
    const double ratio =
        std::cbrt(static_cast<double>(mesh.cells.rows()) / static_cast<double>(question.mesh->cells.rows()));
    const Points l = simulation::Embedding(mesh, places.imaged).at(error.linear.poses[p].x);
    const Points q = simulation::Embedding(meshing::to_quadratic(mesh), places.imaged).at(error.quadratic.poses[p].x);
    const Points change = ratio * (q - l);
    moved = Eigen::Map<const VectorXd>(change.data(), change.size());
  }
  return moved;
}

/// Landmarks err together where they lie close to each other and to a target (discrepancy.h).
void add_beyond_forces_of_landmarks(const calibration::Clusters& clusters, int pose, const Points& targets,
                                    MatrixXd& cross) {
  for (const int row : landmark_rows(clusters, pose)) {
    const int axis = clusters.kind[row] - 1;
    const MatrixXd alike = gaussian_kernel(targets, clusters.place.row(row), beyond_forces_length_mm);
    for (Index i = 0; i < targets.rows(); ++i) cross(3 * i + axis, row) -= share_beyond_forces * alike(i, 0);
  }
}

ExpectedLandmarks expected_landmarks(const JointMoves& joint, const std::vector<int>& rows,
                                     const calibration::MeasuredLandmarks& measured) {
  const Surprise surprise = surprise_of(joint, rows);
  ExpectedLandmarks expected{measured.names, measured.measured, surprise.covariance, surprise.square, surprise.p_value};
  for (Index i = 0; i < expected.expected.rows(); ++i)
    expected.expected.row(i) -= surprise.less_expected.segment<3>(3 * i).transpose();
  return expected;
}

/// What is needed to weigh a scan that was not made.
struct Weighing {
  const JointMoves& joint;
  const BaseFit& base;
  const std::vector<Nuisance>& nuisances;
  const Priors& priors;
  const std::vector<VectorXd>& forces;
  const MatrixXd &data_forces, &target_forces;
};

void add_further_scans(const TargetQuestion& question, const Weighing& with, TargetRegions& regions) {
  const MatrixXd now = covariance_after(with.joint, with.base.size_mm);
  for (const FurtherPose& pose : further_poses(question.pose.gravity, question.anatomy->lateral)) try {
      PoseAt at(*question.mesh, *question.anatomy, question.prone, {pose.name, pose.down}, with.base.model,
                &with.base.fit.prediction.solution);
      const FurtherScan scan = further_scan(at, *question.mesh, *with.base.parameters, with.base.fit.u, with.nuisances,
                                            with.priors, with.forces, mesh_share_of_way);
      const MatrixXd then = covariance_after(with_further_scan(with.joint, scan, with.data_forces, with.target_forces),
                                             with.base.size_mm);
      for (std::size_t p = 0; p < regions.points.size(); ++p) {
        const auto row = 3 * static_cast<Index>(p);
        const double before = now.block<3, 3>(row, row).trace(), after = then.block<3, 3>(row, row).trace();
        regions.points[p].shrinks.push_back({"scan " + pose.name, "a scan in " + pose.name, 1 - after / before});
      }
    } catch (const NumericalFailure&) {
      // No equilibrium in that pose: nothing can be promised.
    }
}

/// Forces scaled to a mean square of 1 mm² along the normal of the skin, as over the clusters of a scan.
void scale_forces(const PoseAt& at, const meshing::TetMesh& mesh, const std::vector<VectorXd>& forces,
                  MatrixXd& moves) {
  const calibration::ModelSkin skin(mesh, at.x());
  const Points normals = skin.node_normals();
  double square = 0;
  for (const VectorXd& force : forces) {
    const Points moved = at.sensitivities.moved_by(0, force);
    for (std::size_t k = 0; k < skin.nodes().size(); ++k)
      square += std::pow(moved.row(skin.nodes()[k]).dot(normals.row(static_cast<Index>(k))), 2);
  }
  moves *= std::sqrt((1 - share_beyond_forces) * static_cast<double>(skin.nodes().size()) / square);
}

}  // namespace

double TargetRegion::sd_mm() const { return std::sqrt(covariance.trace() / 3); }

TargetRegions find_regions(const TargetQuestion& question, calibration::Evaluator& evaluator, const BaseFit& base,
                           const Priors& priors) {
  const auto nuisances = with_those_of(base.model, base.nuisances, question.prone.name, question.pose.name, priors);
  Discrepancy discrepancy;
  JointMoves joint = measured_part(evaluator, base, priors, nuisances, discrepancy);
  PoseAt at(*question.mesh, *question.anatomy, question.prone, question.pose, base.model,
            &base.fit.prediction.solution);
  Places places = places_of(*question.mesh, question.imaged, at.x(), -question.pose.gravity);
  const simulation::Embedding points(*question.mesh, places.imaged);
  const PointMoves moves =
      moves_of(at, points, *base.parameters, base.fit.u, nuisances, priors.patchiness, discrepancy.forces);
  fill_targets(joint, moves, places.there);
  const int row = row_of_pose(evaluator.scene(), question.pose.name);
  MatrixXd columns = discrepancy.columns;
  for (Index i = 0; i < columns.rows(); ++i)
    if (base.clusters.pose[i] != row) columns.row(i) *= common_to_poses;
  joint.cross_kernel = moves.forces * columns.transpose();
  if (row >= 0) add_beyond_forces_of_landmarks(base.clusters, row, places.there, joint.cross_kernel);
  const double mesh = base.numerical ? base.numerical->spread_mm : mesh_share_of_way * at.way_mm();
  const double length = base.numerical ? std::max(5.0, base.numerical->length_mm) : beyond_forces_length_mm;
  const VectorXd finer = moved_by_finer_elements(question, places, base);
  joint.target_errors = mesh_errors(places.there, mesh, length) + finer * finer.transpose();
  const ConditionedTargets known = condition(joint);
  TargetRegions regions = told(question, places, known, names_of(*base.parameters, nuisances));
  for (std::size_t p = 0; p < regions.points.size(); ++p)
    regions.points[p].finer_mm = finer.segment<3>(3 * static_cast<Index>(p));
  regions.measured = true, regions.unexplained_mm = base.size_mm;
  regions.mesh_mm = mesh, regions.mesh_measured = base.numerical.has_value();
  regions.parameters.u = base.fit.u, regions.parameters.nuisances = nuisances;
  regions.parameters.moves = joint.targets.topRows(3 * question.imaged.rows());
  if (question.further_scans)
    add_further_scans(question, {joint, base, nuisances, priors, discrepancy.forces, discrepancy.columns, moves.forces},
                      regions);
  for (TargetRegion& region : regions.points) keep_most(region.shrinks);
  if (const auto rows = landmark_rows(base.clusters, row); !rows.empty())
    regions.landmarks = expected_landmarks(joint, rows, *evaluator.scene().landmarks[static_cast<std::size_t>(row)]);
  return regions;
}

TargetRegions find_regions(const TargetQuestion& question, const simulation::Model& model, const Priors& priors) {
  const FreeParameters free(model);
  const VectorXd u = free.start();
  const auto nuisances = nuisances_of(model, {question.prone.name, question.pose.name}, priors);
  PoseAt at(*question.mesh, *question.anatomy, question.prone, question.pose, model, nullptr);
  const Places places = places_of(*question.mesh, question.imaged, at.x(), -question.pose.gravity);
  const simulation::Embedding points(*question.mesh, places.imaged);
  const auto forces = discrepancy_forces(*question.mesh, at.solution.X);
  PointMoves moves = moves_of(at, points, free, u, nuisances, priors.patchiness, forces);
  scale_forces(at, *question.mesh, forces, moves.forces);
  const Index z = u.size() + static_cast<Index>(nuisances.size());
  JointMoves joint;
  joint.mean = VectorXd::Zero(z), joint.sd = VectorXd::Ones(z);
  for (Index i = 0; i < u.size(); ++i) {
    const auto& prior = free.priors()[static_cast<std::size_t>(i)];
    joint.sd[i] = prior ? prior->sd : open_sd;
  }
  fill_targets(joint, moves, places.there);
  const double way = at.way_mm();
  joint.target_errors = mesh_errors(places.there, mesh_share_of_way * way, beyond_forces_length_mm);
  // The median of the half-Cauchy prior.
  const double size = std::max(priors.least_unexplained_mm, priors.share_of_way * way);
  joint.sizes_mm = VectorXd::Constant(1, size), joint.size_probability = VectorXd::Ones(1);
  TargetRegions regions = told(question, places, condition(joint), names_of(free, nuisances));
  regions.unexplained_mm = size, regions.mesh_mm = mesh_share_of_way * way;
  regions.parameters.u = u, regions.parameters.nuisances = nuisances;
  regions.parameters.moves = joint.targets.topRows(3 * question.imaged.rows());
  for (TargetRegion& region : regions.points) keep_most(region.shrinks);
  return regions;
}

}  // namespace supine::diagnosis
