// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "registration/match.h"

namespace supine::registration {

/// Unknowns: motion (t mm, ω rad) about a pivot, then the softness, the share of its displacement by which the body
/// moves further than predicted.
constexpr int unknowns = 7;
using State = Eigen::Matrix<double, unknowns, 1>;

/// One row per measured number: a matched point along the normal (point to plane), a landmark along each axis.
/// Moving the scan by a small x changes the residuals to residual + jacobian · x.
struct Observations {
  Eigen::MatrixXd jacobian;  ///< #O by unknowns
  Eigen::VectorXd residual;  ///< #O, mm; scan minus body
  Eigen::VectorXd noise_mm;  ///< #O, 1 sigma of its own
  Points place, direction;   ///< #O by 3; along the direction the residual is taken
  std::vector<bool> rigid;
};

/// Which matches count.
struct Gate {
  double reach_mm;           ///< closer than this
  bool with_border = false;  ///< those beyond the border as well, along the line to it: they pull the scan back
};

/// @param rows      of the problem's points
/// @param softness  the present one of the landmarks; the problem's skin is taken as it is
Observations observe(const Problem& problem, const std::vector<int>& rows, const RigidTransform& placement,
                     const Eigen::Vector3d& pivot, double softness, const Gate& gate);

}  // namespace supine::registration
