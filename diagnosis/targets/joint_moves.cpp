// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/joint_moves.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/evidence/field_modes.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd beyond_forces(const Points& places) {
  const MatrixXd plain = gaussian_kernel(places, places, beyond_forces_length_mm);
  MatrixXd all = MatrixXd::Zero(3 * places.rows(), 3 * places.rows());
  for (Index i = 0; i < plain.rows(); ++i)
    for (Index j = 0; j < plain.cols(); ++j)
      for (int a = 0; a < 3; ++a) all(3 * i + a, 3 * j + a) = share_beyond_forces * plain(i, j);
  return all;
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

/// Where rows of a base fit's directions stand among those of the joint moves: nuisances of the pose alone come between
/// its own and the numbers of effects.
struct Placed {
  Index known, further;

  int row(int of_base) const { return of_base < known ? of_base : of_base + static_cast<int>(further); }
  std::vector<int> rows(const std::vector<int>& of_base) const {
    std::vector<int> all;
    for (const int r : of_base) all.push_back(row(r));
    for (Index k = 0; k < further; ++k) all.push_back(static_cast<int>(known + k));
    return all;
  }
};

void fill_directions(const Directions& all, const Placed& placed, JointMoves& joint) {
  const Index z = all.size() + placed.further;
  joint.data = MatrixXd::Zero(all.columns.rows(), z);
  joint.mean = VectorXd::Zero(z), joint.sd = VectorXd::Ones(z);
  joint.least = VectorXd::Constant(z, -std::numeric_limits<double>::infinity());
  for (int r = 0; r < all.size(); ++r) {
    const int row = placed.row(r);
    joint.data.col(row) = all.columns.col(r);
    joint.mean[row] = all.mean[r], joint.sd[row] = all.sd[r];
    if (all.one_sided[static_cast<std::size_t>(r)]) joint.least[row] = all.least[r];
  }
}

}  // namespace

double mesh_share_of_way() { return 0.045 / std::sqrt(3.0); }

std::vector<Nuisance> with_those_of(const simulation::Model& model, std::vector<Nuisance> known,
                                    const std::string& imaged, const std::string& pose, const Priors& priors) {
  for (const Nuisance& nuisance : known)
    if (nuisance.pose == pose) return known;
  for (Nuisance& nuisance : nuisances_of(model, {imaged, pose}, priors))
    if (nuisance.pose == pose) known.push_back(std::move(nuisance));
  return known;
}

void fill_targets(const PointMoves& moves, const MatrixXd& effects, JointMoves& joint) {
  joint.targets.resize(moves.parameters.rows(), moves.parameters.cols() + moves.nuisances.cols() + effects.cols());
  joint.targets << moves.parameters, moves.nuisances, effects;
  joint.target_patches = moves.patches;
}

MatrixXd target_kernel(const MatrixXd& forces, const Points& places) {
  return forces * forces.transpose() + beyond_forces(places);
}

void fill_kernels(const BaseFit& base, const Discrepancy& discrepancy, const MatrixXd& forces, const Points& places,
                  int pose, JointMoves& joint) {
  joint.data_kernel = discrepancy.kernel;
  joint.target_kernel = target_kernel(forces, places);
  MatrixXd columns = discrepancy.columns;
  for (Index i = 0; i < columns.rows(); ++i)
    if (base.clusters.pose[i] != pose) columns.row(i) *= common_to_poses;
  joint.cross_kernel = forces * columns.transpose();
  if (pose >= 0) add_beyond_forces_of_landmarks(base.clusters, pose, places, joint.cross_kernel);
}

MatrixXd mesh_errors(const Points& places, double sd_mm, double length_mm) {
  MatrixXd all = MatrixXd::Zero(3 * places.rows(), 3 * places.rows());
  for (Index i = 0; i < places.rows(); ++i)
    for (Index j = 0; j < places.rows(); ++j)
      for (int a = 0; a < 3; ++a)
        all(3 * i + a, 3 * j + a) = sd_mm * sd_mm * std::exp(-(places.row(i) - places.row(j)).norm() / length_mm);
  return all;
}

std::vector<int> landmark_rows(const calibration::Clusters& clusters, int pose) {
  std::vector<int> rows;
  for (Index i = 0; i < clusters.kind.size(); ++i)
    if (clusters.kind[i] > 0 && clusters.pose[i] == pose) rows.push_back(static_cast<int>(i));
  return rows;
}

void scale_forces(const PoseAt& at, const meshing::TetMesh& mesh, const std::vector<VectorXd>& forces,
                  MatrixXd& moves) {
  const calibration::ModelSkin skin(mesh, at.x());
  const Points normals = skin.node_normals();
  double square = 0;
  for (const Points& moved : at.sensitivities.moved_by(0, forces)) {
    for (std::size_t k = 0; k < skin.nodes().size(); ++k)
      square += std::pow(moved.row(skin.nodes()[k]).dot(normals.row(static_cast<Index>(k))), 2);
  }
  moves *= std::sqrt((1 - share_beyond_forces) * static_cast<double>(skin.nodes().size()) / square);
}

MeasuredPart measured_part(calibration::Evaluator& evaluator, const BaseFit& base, const MissingEffects& missing,
                           const Priors& priors, const std::vector<Nuisance>& nuisances) {
  const simulation::Sensitivities at_data(evaluator.chain(), base.model, base.fit.prediction.solution);
  const calibration::Residuals& residuals = base.fit.residuals;
  MeasuredPart part{{},
                    discrepancy_of(*evaluator.scene().mesh, at_data, base.fit.prediction, residuals, base.clusters)};
  JointMoves& joint = part.joint;
  const bool screened = !missing.hypotheses.empty();
  const Directions all = screened ? missing.hypotheses.front().evidence->directions()
                                  : directions_at(base.fit, *base.parameters, base.nuisances, base.clusters);
  joint.y = base.distances(residuals);
  const Index known = base.fit.u.size() + static_cast<Index>(base.nuisances.size());
  const Placed placed{known, base.fit.u.size() + static_cast<Index>(nuisances.size()) - known};
  fill_directions(all, placed, joint);
  joint.data_patches = base.clusters.means(
      patchiness_shapes(evaluator.chain(), at_data, base.fit.prediction, residuals, priors.patchiness));
  // The fit took both where it began; distances and targets must be moved by the same ones.
  joint.data_errors =
      base.errors - base.patches * base.patches.transpose() + joint.data_patches * joint.data_patches.transpose();
  joint.sizes_mm = base.covariance->sizes_mm();
  for (const Hypothesis& h : missing.hypotheses)
    joint.sets.push_back({placed.rows(h.rows), h.probability * h.weighed.size_probability});
  if (screened) return part;
  joint.sets.push_back({placed.rows(first_rows(all.size())), evidence_of(base, base).weigh_all().size_probability});
  return part;
}

JointMoves believed_part(const FreeParameters& free, const std::vector<Nuisance>& nuisances,
                         const BelievedEffects& believed, const Priors& priors, double way_mm) {
  constexpr double open_sd = 3;  // coordinates of a parameter without prior, as in directions_at()
  const Index own = free.size(), before = own + static_cast<Index>(nuisances.size()),
              z = before + static_cast<Index>(believed.numbers.size());
  JointMoves joint;
  joint.mean = VectorXd::Zero(z), joint.sd = VectorXd::Ones(z);
  joint.least = VectorXd::Constant(z, -std::numeric_limits<double>::infinity());
  for (Index i = 0; i < own; ++i) {
    const auto& prior = free.priors()[static_cast<std::size_t>(i)];
    joint.sd[i] = prior ? prior->sd : open_sd;
  }
  for (std::size_t k = 0; k < believed.numbers.size(); ++k) {
    const auto row = before + static_cast<Index>(k);
    joint.mean[row] = believed.numbers[k].mean, joint.sd[row] = believed.numbers[k].sd;
    if (believed.numbers[k].least) joint.least[row] = *believed.numbers[k].least;
  }
  const SizeBins bins =
      size_bins(std::max(priors.least_unexplained_mm, priors.share_of_way * way_mm), priors.most_unexplained_mm);
  joint.sizes_mm = bins.sizes_mm;
  for (const DirectionSet& set : believed.rows) joint.sets.push_back({set.rows, set.size_probability[0] * bins.prior});
  return joint;
}

}  // namespace supine::diagnosis
