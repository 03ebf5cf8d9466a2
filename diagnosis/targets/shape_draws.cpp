// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/shape_draws.h"

#include <vector>

#include "diagnosis/evidence/mean_kernel.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// What each force moves the targets by in the pose of the moved fit, #t by #f.
MatrixXd target_forces(const TargetPose& target, const simulation::Embedding& points, const MovedFit& moved) {
  const PoseAt at(*target.mesh, *target.anatomy, target.imaged, target.pose, moved.model, &moved.prediction.solution);
  const std::vector<Points> by_force = at.sensitivities.moved_by(0, moved.discrepancy.forces);
  MatrixXd forces(3 * points.outside_mm().size(), static_cast<Index>(by_force.size()));
  for (std::size_t f = 0; f < by_force.size(); ++f) {
    const Points moves = points.at(by_force[f]);
    forces.col(static_cast<Index>(f)) = Eigen::Map<const Eigen::VectorXd>(moves.data(), moves.size());
  }
  return forces;
}

}  // namespace

void allow_for_shapes(const calibration::MeasuredScene& scene, const BaseFit& base, const TargetPose& target,
                      JointMoves& joint) {
  const simulation::Embedding points(*target.mesh, target.places->imaged);
  std::vector<JointMoves> draws(kernel_draws);
  look_at_draws(scene, base, [&](std::size_t k, const MovedFit& moved) {
    fill_kernels(base, moved.discrepancy, target_forces(target, points, moved), target.places->there, target.measured,
                 draws[k]);
  });
  int solved = 1;
  for (const JointMoves& draw : draws) {
    if (draw.data_kernel.size() == 0) continue;
    joint.data_kernel += draw.data_kernel, joint.cross_kernel += draw.cross_kernel;
    joint.target_kernel += draw.target_kernel;
    ++solved;
  }
  joint.data_kernel /= solved, joint.cross_kernel /= solved, joint.target_kernel /= solved;
}

}  // namespace supine::diagnosis
