// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/further_scan.h"

#include <cmath>

#include "calibration/model_skin.h"
#include "calibration/scan_motion.h"
#include "diagnosis/evidence/discrepancy.h"
#include "diagnosis/evidence/field_modes.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int most_places = 150;
// Of the mean over the points of one place: white noise of 0.7 mm over five of them.
constexpr double place_noise_mm = 0.3;

/// Places of the skin as a scanner sees them.
struct Seen {
  Points imaged, there, normal;
};

Seen seen_in(const meshing::TetMesh& mesh, const Points& x) {
  const calibration::ModelSkin skin(mesh, x);
  const Points all = skin.node_points();
  const std::vector<int> rows = spread_out(all, most_places);
  Seen seen{Points(static_cast<Index>(rows.size()), 3), all(rows, Eigen::all), skin.node_normals()(rows, Eigen::all)};
  for (std::size_t i = 0; i < rows.size(); ++i)
    seen.imaged.row(static_cast<Index>(i)) = mesh.points.row(skin.nodes()[static_cast<std::size_t>(rows[i])]);
  return seen;
}

/// Columns of 3 rows per place along the normals, as distances change: less where the skin moves out.
MatrixXd along(const Points& normal, const MatrixXd& columns) {
  MatrixXd changes(normal.rows(), columns.cols());
  for (Index i = 0; i < normal.rows(); ++i) changes.row(i) = -normal.row(i) * columns.middleRows<3>(3 * i);
  return changes;
}

/// What the scan's own motion does to its distances, per sigma of each nuisance of the pose.
void add_scan_motion(const PoseAt& at, const Seen& seen, const std::vector<Nuisance>& own, MatrixXd& columns) {
  for (std::size_t k = 0; k < own.size(); ++k) {
    if (own[k].effect.empty()) continue;
    const auto fields = at.chain.fields(at.model, at.chain.poses()[1], own[k].effect + "." + own[k].parameter);
    if (simulation::derivatives_of(fields).scan_motion.isZero(0)) continue;
    const Points moved = calibration::corrected_derivative(fields.scan_motion, seen.there, seen.there);
    columns.col(static_cast<Index>(k)) += own[k].sigma * moved.cwiseProduct(seen.normal).rowwise().sum();
  }
}

MatrixXd errors_of(const Seen& seen, const Priors& priors, double mesh_mm) {
  MatrixXd errors =
      std::pow(priors.scan_shared_mm, 2) * gaussian_kernel(seen.there, seen.there, priors.scan_shared_length_mm);
  for (Index i = 0; i < errors.rows(); ++i)
    for (Index j = 0; j < errors.cols(); ++j)
      errors(i, j) +=
          mesh_mm * mesh_mm * std::exp(-(seen.there.row(i) - seen.there.row(j)).norm() / beyond_forces_length_mm);
  errors.diagonal().array() += place_noise_mm * place_noise_mm;
  return errors;
}

/// a over b, each beside its own cross block.
MatrixXd with_block(const MatrixXd& a, const MatrixXd& b, const MatrixXd& cross) {
  MatrixXd both(a.rows() + b.rows(), a.cols() + b.cols());
  both << a, cross, cross.transpose(), b;
  return both;
}

}  // namespace

FurtherScan further_scan(PoseAt& at, const meshing::TetMesh& mesh, const calibration::FreeParameters& free,
                         const VectorXd& u, const std::vector<Nuisance>& nuisances, const Priors& priors,
                         const std::vector<VectorXd>& forces, double mesh_share) {
  const Seen seen = seen_in(mesh, at.x());
  std::vector<Nuisance> own;
  for (Nuisance& nuisance : nuisances_of(at.model, {at.chain.poses()[0].name, at.chain.poses()[1].name}, priors))
    if (nuisance.pose == at.chain.poses()[1].name) own.push_back(std::move(nuisance));
  std::vector<Nuisance> all = nuisances;
  all.insert(all.end(), own.begin(), own.end());
  const PointMoves moves =
      moves_of(at, simulation::Embedding(mesh, seen.imaged), free, u, all, priors.patchiness, forces);
  FurtherScan scan;
  MatrixXd of_own = along(seen.normal, moves.nuisances.rightCols(static_cast<Index>(own.size())));
  add_scan_motion(at, seen, own, of_own);
  scan.directions.resize(seen.there.rows(), u.size() + static_cast<Index>(all.size()));
  scan.directions << along(seen.normal, moves.parameters),
      along(seen.normal, moves.nuisances.leftCols(static_cast<Index>(nuisances.size()))), of_own;
  scan.patches = along(seen.normal, moves.patches);
  scan.forces = along(seen.normal, moves.forces);
  scan.errors = errors_of(seen, priors, mesh_share * at.way_mm());
  scan.kernel = scan.forces * scan.forces.transpose() +
                share_beyond_forces * gaussian_kernel(seen.there, seen.there, beyond_forces_length_mm);
  return scan;
}

JointMoves with_further_scan(const JointMoves& joint, const FurtherScan& scan, const MatrixXd& data_forces,
                             const MatrixXd& target_forces) {
  JointMoves more = joint;
  const Index n = joint.data.rows(), h = scan.directions.rows(), z = scan.directions.cols(), before = joint.sd.size();
  more.mean = VectorXd::Zero(z), more.sd = VectorXd::Ones(z);
  more.mean.head(before) = joint.mean, more.sd.head(before) = joint.sd;
  more.data = MatrixXd::Zero(n + h, z);
  more.data.topLeftCorner(n, before) = joint.data;
  more.data.bottomRows(h) = scan.directions;
  more.targets = MatrixXd::Zero(joint.targets.rows(), z);
  more.targets.leftCols(before) = joint.targets;
  more.y = VectorXd::Zero(n + h);
  more.y.head(n) = joint.y;
  more.data_patches.resize(n + h, scan.patches.cols());
  more.data_patches << joint.data_patches, scan.patches;
  more.data_errors = with_block(joint.data_errors, scan.errors + scan.patches * scan.patches.transpose(),
                                joint.data_patches * scan.patches.transpose());
  more.data_kernel =
      with_block(joint.data_kernel, scan.kernel, common_to_poses * data_forces * scan.forces.transpose());
  more.cross_kernel.resize(joint.targets.rows(), n + h);
  more.cross_kernel << joint.cross_kernel, common_to_poses * target_forces * scan.forces.transpose();
  return more;
}

}  // namespace supine::diagnosis
