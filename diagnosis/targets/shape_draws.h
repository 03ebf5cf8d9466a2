// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/targets/joint_moves.h"

namespace supine::diagnosis {

/// The pose that places are asked for, and the places.
struct TargetPose {
  const meshing::TetMesh* mesh;
  const meshing::Anatomy* anatomy;
  simulation::PoseLoad imaged, pose;
  int measured;          ///< row of the pose among the measured ones; -1: none of them
  const Places* places;  ///< in the pose at the fit
};

/// What unknown forces make of distances and targets together is as open as the numbers of the fit are (mean_kernel.h):
/// the kernels become the mean of those at the fit and at the same draws, all three of one draw together, so that they
/// stay a covariance. Draws without an equilibrium in the pose are left out.
/// @param joint  in: kernels of the fit (fill_kernels); out: their mean
void allow_for_shapes(const calibration::MeasuredScene& scene, const BaseFit& base, const TargetPose& target,
                      JointMoves& joint);

}  // namespace supine::diagnosis
