// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/regions.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calibration/model_skin.h"
#include "common/error.h"
#include "diagnosis/evidence/mean_kernel.h"
#include "diagnosis/evidence/nuisance_words.h"
#include "diagnosis/further_poses.h"
#include "diagnosis/targets/further_scan.h"
#include "diagnosis/targets/joint_moves.h"
#include "diagnosis/targets/shape_draws.h"
#include "meshing/topology.h"
#include "simulation/catalogue.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double marker_mm = 1.5;  // of a marker's place, each axis; as of landmarks that state no sigma_mm
constexpr std::size_t most_told = 6, sets_told = 6;

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

/// What could become known: directions that belong together.
struct Knowable {
  std::string what, in_words;
  std::vector<int> rows;
};

std::vector<Knowable> knowable(const FreeParameters& free, const std::vector<Nuisance>& nuisances,
                               const std::vector<EffectNumber>& numbers) {
  std::vector<std::string> names = free.names();
  for (const Nuisance& nuisance : nuisances) names.push_back(nuisance.name());
  std::vector<Knowable> all;
  for (const std::string& name : names)
    all.push_back({name, "knowing " + words_of(name), {static_cast<int>(all.size())}});
  const std::size_t before = all.size();
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const std::string& effect = numbers[k].effect;
    if (all.size() == before || all.back().what != effect)
      all.push_back(
          {effect,
           fmt::format("a diagnosis that settles {} ({})", effect, simulation::find_effect(effect)->meaning()),
           {}});
    all.back().rows.push_back(static_cast<int>(before + k));
  }
  return all;
}

std::vector<Shrink> shrinks_of(const ConditionedTargets& known, const std::vector<Knowable>& all_knowable, Index row,
                               Index skin_row) {
  const Matrix3d own = known.covariance.block<3, 3>(row, row);
  std::vector<Shrink> all;
  for (const Knowable& one : all_knowable) {
    std::vector<int> open;  // what no set has is known to be zero
    for (const int k : one.rows)
      if (known.directions_covariance(k, k) > 0) open.push_back(k);
    if (open.empty()) continue;
    const MatrixXd cross = known.with_directions.middleRows<3>(row)(Eigen::all, open);
    all.push_back({one.what, one.in_words, gone(cross, known.directions_covariance(open, open), own)});
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

Ellipsoid ellipsoid_of(const Vector3d& place, const Matrix3d& covariance, double reach) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return {place, covariance, std::sqrt(reach) * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().reverse()};
}

/// The same if it were known that nothing is missing.
void add_if_nothing_missing(JointMoves joint, Index directions, const Places& places, TargetRegions& regions) {
  std::erase_if(joint.sets, [directions](const DirectionSet& set) {
    return std::any_of(set.rows.begin(), set.rows.end(), [directions](int row) { return row >= directions; });
  });
  if (joint.sets.empty() || !(joint.sets[0].size_probability.sum() > 0)) return;
  joint.sets.resize(1);
  joint.sets[0].size_probability /= joint.sets[0].size_probability.sum();
  const ConditionedTargets known = condition(joint);
  for (std::size_t p = 0; p < regions.points.size(); ++p) {
    const auto row = 3 * static_cast<Index>(p);
    regions.points[p].if_nothing_missing =
        ellipsoid_of(places.there.row(static_cast<Index>(p)).transpose() + known.mean.segment<3>(row),
                     known.covariance.block<3, 3>(row, row), known.reach95[static_cast<Index>(p)]);
  }
}

/// Six rows of two points.
Eigen::Matrix<double, 6, 6> of_two(const MatrixXd& covariance, Index a, Index b) {
  Eigen::Matrix<double, 6, 6> both;
  both << covariance.block<3, 3>(a, a), covariance.block<3, 3>(a, b), covariance.block<3, 3>(b, a),
      covariance.block<3, 3>(b, b);
  return both;
}

TargetRegions told(const TargetQuestion& question, const Places& places, const ConditionedTargets& known,
                   const std::vector<Knowable>& all_knowable) {
  const Index count = question.imaged.rows();
  const Eigen::VectorXd outside = simulation::Embedding(*question.mesh, question.imaged).outside_mm();
  const Points moved = places.there + Eigen::Map<const Points>(known.mean.data(), 3 * count, 3);
  TargetRegions regions;
  regions.covariance = known.covariance.topLeftCorner(3 * count, 3 * count);
  regions.parameters.mean = known.directions_mean, regions.parameters.covariance = known.directions_covariance;
  regions.parameters.parts = known.parts;
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
    region.half_axes_mm = std::sqrt(known.reach95[p]) * eigen.eigenvalues().cwiseSqrt().reverse();
    region.axes = eigen.eigenvectors().rowwise().reverse();
    const Index near = count + p, over = 2 * count + p;
    const auto k = static_cast<std::size_t>(p);
    region.nearest = depth_of(region.place_mm, moved.row(near), places.normal[k], places.normal[k],
                              of_two(known.covariance, 3 * p, 3 * near));
    if (places.has_straight[k] && places.straight_normal[k].dot(question.pose.gravity) < -0.1)
      region.straight = depth_of(region.place_mm, moved.row(over), places.straight_normal[k], -question.pose.gravity,
                                 of_two(known.covariance, 3 * p, 3 * over));
    region.shrinks = shrinks_of(known, all_knowable, 3 * p, 3 * near);
    regions.points.push_back(std::move(region));
  }
  return regions;
}

int row_of_pose(const calibration::MeasuredScene& scene, const std::string& pose) {
  for (std::size_t m = 0; m < scene.measurements.size(); ++m)
    if (scene.measurements[m]->pose.name == pose) return static_cast<int>(m);
  return -1;
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

ExpectedLandmarks expected_landmarks(const JointMoves& joint, const std::vector<int>& rows,
                                     const calibration::MeasuredLandmarks& measured) {
  const Expected by_others = expected_by_others(joint, rows);
  ExpectedLandmarks found{{measured.names, measured.measured, by_others.covariance}, {}};
  for (Index i = 0; i < found.expected.places.rows(); ++i)
    found.expected.places.row(i) -= by_others.less_expected.segment<3>(3 * i).transpose();
  found.agreement = calibration::compare_to_expected({measured.names, measured.measured, {}}, found.expected);
  return found;
}

/// The moves as if nothing were missing.
JointMoves without_effects(const JointMoves& joint, Index directions) {
  JointMoves less = joint;
  less.mean.conservativeResize(directions), less.sd.conservativeResize(directions);
  less.data.conservativeResize(Eigen::NoChange, directions),
      less.targets.conservativeResize(Eigen::NoChange, directions);
  return less;
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

/// How much of the variances a scan of a further pose would take as if nothing were missing; that it might also show
/// what is missing does not count.
void add_further_scans(const TargetQuestion& question, const Weighing& with, TargetRegions& regions) {
  const JointMoves joint =
      without_effects(with.joint, with.base.fit.u.size() + static_cast<Index>(with.nuisances.size()));
  const MatrixXd now = covariance_after(joint, with.base.size_mm);
  for (const FurtherPose& pose : further_poses(question.pose.gravity, question.anatomy->lateral)) try {
      PoseAt at(*question.mesh, *question.anatomy, question.prone, {pose.name, pose.down}, with.base.model,
                &with.base.fit.prediction.solution);
      const FurtherScan scan = further_scan(at, *question.mesh, *with.base.parameters, with.base.fit.u, with.nuisances,
                                            with.priors, with.forces, mesh_share_of_way());
      const MatrixXd then =
          covariance_after(with_further_scan(joint, scan, with.data_forces, with.target_forces), with.base.size_mm);
      for (std::size_t p = 0; p < regions.points.size(); ++p) {
        const auto row = 3 * static_cast<Index>(p);
        const double taken = (now - then).block<3, 3>(row, row).trace();
        regions.points[p].shrinks.push_back({"scan " + pose.name, "a scan in " + pose.name,
                                             std::clamp(taken / regions.points[p].covariance.trace(), 0.0, 1.0)});
      }
    } catch (const NumericalFailure&) {
      // No equilibrium in that pose: nothing can be promised.
    }
}

std::vector<EffectNumber> numbers_of(const MissingEffects& missing, const JointMoves& joint, Index before) {
  std::vector<EffectNumber> numbers;
  for (const Candidate& candidate : missing.candidates)
    for (const CandidateParameter& number : candidate.parameters) {
      const Index row = before + static_cast<Index>(numbers.size());
      const double least = joint.least[row];
      numbers.push_back({candidate.effect, number.name, number.null, joint.mean[row], joint.sd[row],
                         std::isfinite(least) ? std::optional(least) : std::nullopt});
    }
  return numbers;
}

void fill_parameters(const VectorXd& u, const std::vector<Nuisance>& nuisances,
                     const std::vector<EffectNumber>& effects, const JointMoves& joint, Index points,
                     ParameterPart& part) {
  part.u = u, part.nuisances = nuisances, part.effects = effects;
  part.moves = joint.targets.topRows(3 * points);
}

/// By how much a parameter of the model that lacks nothing would go on from where the fit stopped.
double unsettled_by(const BaseFit& base) {
  const JointPosterior posterior = posterior_of(base);
  double most = 0;
  const VectorXd unit = base.parameters->slope(base.fit.u);
  for (Index i = 0; i < base.fit.u.size(); ++i)
    most = std::max(most, std::abs(posterior.value[i] - base.parameters->value(i, base.fit.u[i])) / std::abs(unit[i]));
  return most;
}

}  // namespace

double TargetRegion::sd_mm() const { return std::sqrt(covariance.trace() / 3); }

TargetRegions find_regions(const TargetQuestion& question, calibration::Evaluator& evaluator, const BaseFit& base,
                           const MissingEffects& missing, const Priors& priors) {
  const auto nuisances = with_those_of(base.model, base.nuisances, question.prone.name, question.pose.name, priors);
  MeasuredPart measured = measured_part(evaluator, base, missing, priors, nuisances);
  JointMoves& joint = measured.joint;
  PoseAt at(*question.mesh, *question.anatomy, question.prone, question.pose, base.model,
            &base.fit.prediction.solution);
  const Places places = places_of(*question.mesh, question.imaged, at.x(), -question.pose.gravity);
  const simulation::Embedding points(*question.mesh, places.imaged);
  const PointMoves moves =
      moves_of(at, points, *base.parameters, base.fit.u, nuisances, priors.patchiness, measured.discrepancy.forces);
  fill_targets(moves, effect_moves(*question.mesh, *question.anatomy, at, points, missing.candidates), joint);
  const int row = row_of_pose(evaluator.scene(), question.pose.name);
  fill_kernels(base, measured.discrepancy, moves.forces, places.there, row, joint);
  const double mesh = base.numerical ? base.numerical->spread_mm : mesh_share_of_way() * at.way_mm();
  const double length = base.numerical ? std::max(5.0, base.numerical->length_mm) : beyond_forces_length_mm;
  const VectorXd finer = moved_by_finer_elements(question, places, base);
  joint.target_errors = mesh_errors(places.there, mesh, length) + finer * finer.transpose();
  const JointMoves at_fit = joint;
  if (base.size_mm >= least_size_of_mean_kernel_mm)
    allow_for_shapes(evaluator.scene(), base,
                     {question.mesh, question.anatomy, question.prone, question.pose, row, &places}, joint);
  const auto numbers = numbers_of(missing, joint, base.fit.u.size() + static_cast<Index>(nuisances.size()));
  TargetRegions regions = told(question, places, condition(joint), knowable(*base.parameters, nuisances, numbers));
  add_if_nothing_missing(joint, base.fit.u.size() + static_cast<Index>(nuisances.size()), places, regions);
  for (std::size_t p = 0; p < regions.points.size(); ++p)
    regions.points[p].finer_mm = finer.segment<3>(3 * static_cast<Index>(p));
  regions.measured = true, regions.unexplained_mm = base.size_mm, regions.unsettled_by = unsettled_by(base);
  regions.mesh_mm = mesh, regions.mesh_measured = base.numerical.has_value();
  regions.sets = missing.likeliest(sets_told);
  fill_parameters(base.fit.u, nuisances, numbers, joint, question.imaged.rows(), regions.parameters);
  if (question.further_scans)
    add_further_scans(
        question,
        {at_fit, base, nuisances, priors, measured.discrepancy.forces, measured.discrepancy.columns, moves.forces},
        regions);
  for (TargetRegion& region : regions.points) keep_most(region.shrinks);
  if (const auto rows = landmark_rows(base.clusters, row); !rows.empty())
    regions.landmarks = expected_landmarks(joint, rows, *evaluator.scene().landmarks[static_cast<std::size_t>(row)]);
  return regions;
}

TargetRegions find_regions(const TargetQuestion& question, const simulation::Model& model, bool may_lack,
                           const Priors& priors) {
  const FreeParameters free(model);
  const VectorXd u = free.start();
  const auto nuisances = nuisances_of(model, {question.prone.name, question.pose.name}, priors);
  PoseAt at(*question.mesh, *question.anatomy, question.prone, question.pose, model, nullptr);
  const Places places = places_of(*question.mesh, question.imaged, at.x(), -question.pose.gravity);
  const simulation::Embedding points(*question.mesh, places.imaged);
  const auto forces = discrepancy_forces(*question.mesh, at.solution.X);
  PointMoves moves = moves_of(at, points, free, u, nuisances, priors.patchiness, forces);
  scale_forces(at, *question.mesh, forces, moves.forces);
  const double way = at.way_mm();
  const BelievedEffects believed =
      believed_effects(model, *question.mesh, *question.anatomy, u.size(), nuisances, priors, may_lack);
  JointMoves joint = believed_part(free, nuisances, believed, priors, way);
  fill_targets(moves, effect_moves(*question.mesh, *question.anatomy, at, points, believed.candidates), joint);
  joint.target_kernel = target_kernel(moves.forces, places.there);
  joint.target_errors = mesh_errors(places.there, mesh_share_of_way() * way, beyond_forces_length_mm);
  TargetRegions regions = told(question, places, condition(joint), knowable(free, nuisances, believed.numbers));
  add_if_nothing_missing(joint, u.size() + static_cast<Index>(nuisances.size()), places, regions);
  // The median of the half-Cauchy prior.
  regions.unexplained_mm = std::max(priors.least_unexplained_mm, priors.share_of_way * way);
  regions.mesh_mm = mesh_share_of_way() * way;
  if (may_lack)
    regions.sets.assign(believed.sets.begin(),
                        believed.sets.begin() + static_cast<std::ptrdiff_t>(std::min(sets_told, believed.sets.size())));
  fill_parameters(u, nuisances, believed.numbers, joint, question.imaged.rows(), regions.parameters);
  for (TargetRegion& region : regions.points) keep_most(region.shrinks);
  return regions;
}

}  // namespace supine::diagnosis
