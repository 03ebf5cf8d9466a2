// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "calibration/residuals.h"

namespace supine::calibration {

/// Splits points into @p count blocks of the skin by k-means of their anatomy coordinates (Lloyd), started from the
/// points that lie furthest from each other, so without any chance. Poses share the blocks: the same skin is left out
/// everywhere. Does not depend on the order of the points.
/// @return block of each residual, 0 to count − 1
Eigen::VectorXi spatial_blocks(const Residuals& residuals, int count = 6);

/// Distances as they would be if each point's block had not been fitted: for every block the parameters are estimated
/// again without it, by one linear step from the optimum, and the block is predicted.
/// @param slope   ∂d/∂u of what is fitted, at the optimum, #R by #parameters
/// @param priors  information of the priors, #parameters; 0 = none
Eigen::VectorXd held_out_distances(const Residuals& residuals, const Eigen::MatrixXd& slope,
                                   const Eigen::VectorXd& priors, const Eigen::VectorXi& blocks);

}  // namespace supine::calibration
