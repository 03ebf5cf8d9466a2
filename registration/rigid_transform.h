// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "common/arrays.h"

namespace supine::registration {

/// y = R x + t, mm.
struct RigidTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();

  Points apply(const Points& points) const;
  Points apply_to_directions(const Points& directions) const;
  Eigen::Vector3d at(const Eigen::Vector3d& point) const { return rotation * point + shift; }
  RigidTransform inverse() const;
  /// First this, then @p next.
  RigidTransform then(const RigidTransform& next) const;
};

/// Shift in mm, then rotation vector in rad.
using Motion = Eigen::Matrix<double, 6, 1>;

/// y = c + exp([ω]) (x − c) + t for @p motion (t, ω) about the centre c = @p pivot.
RigidTransform turned_about(const Eigen::Vector3d& pivot, const Motion& motion);

/// (t, ω) for which turned_about() gives @p transform; |ω| ≤ π.
Motion motion_about(const Eigen::Vector3d& pivot, const RigidTransform& transform);

/// The rigid transform that brings rows of @p from closest to those of @p to, least squares with @p weights (#P, > 0;
/// Umeyama 1991 without scale).
/// @param mirror  the best one with determinant −1
/// @pre  3 rows at least
RigidTransform best_rigid(const Points& from, const Points& to, const Eigen::VectorXd& weights, bool mirror = false);

}  // namespace supine::registration
