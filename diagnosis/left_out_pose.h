// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnosis/error_sources.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {

/// Distances of each fitted pose as they would be had it not been fitted: the least of F over the other poses alone,
/// under their errors, by one linear step that stays in the parameters' ranges; the mesh's error taken away as far as
/// it is known. Empty with fewer than two poses.
/// @param sources  of all fitted points, in the order of the fit's residuals
std::vector<Eigen::VectorXd> left_out_poses_mm(const WeightedFit& fit, const calibration::FreeParameters& parameters,
                                               const ErrorSources& sources);

}  // namespace supine::diagnosis
