// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/least_squares.h"

namespace supine::calibration {

/// Minimum of g·s + ½ s·A s over lower <= s <= upper, by an active set (Nocedal and Wright, Numerical Optimization,
/// 16.5): exact but for rounding, for a handful of unknowns.
/// @pre  lower <= 0 <= upper; A symmetric, positive semidefinite. Where lower = upper = 0, s is 0
Eigen::VectorXd box_step(const Eigen::MatrixXd& a, const Eigen::VectorXd& g, const Eigen::VectorXd& lower,
                         const Eigen::VectorXd& upper);

/// One descent of the cost of fit_least_squares() with a fixed set of points: Gauss-Newton steps inside the ranges and
/// a trust region (Nocedal and Wright, 4.1 and 10.3), a box in the coordinates of FreeParameters: a modulus goes by a
/// factor of 4.5 at most, and by less after a step that brought less than it promised, or led where no equilibrium was
/// found. Such a trial is given up once a solve has cost three times the dearest of runs that were of use.
///
/// Settled: the Gauss-Newton step within the ranges is less than a twentieth of a standard deviation (a tenth for
/// @p rough descents), in the metric of JᵀJ for points that err by themselves with their noise, or with their rms where
/// that is larger.
///
/// @param start  number of the descent, for the history
/// @param held   coordinates that stay where they are; empty = none
/// @param linearisation  of the prediction, to start trials from; nullptr = none is known
/// @param fit    in: u, prediction, mask; out: all of it
/// @throws InputError        every coordinate is held
/// @throws NumericalFailure  the mask leaves no point
void descend(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options, int start,
             const std::vector<bool>& held, const Linearisation* linearisation, bool rough, Fit& fit);

}  // namespace supine::calibration
