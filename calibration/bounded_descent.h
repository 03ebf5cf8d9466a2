// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "calibration/least_squares.h"

namespace supine::calibration {

/// One descent of the cost of fit_least_squares() with a fixed set of points: Levenberg-Marquardt (Ceres) with an
/// active set (Nocedal and Wright, Numerical Optimization, 16.5).
///
/// A coordinate that sits at an end of its range with the cost falling only beyond it is held there while the others
/// are fitted: a step that is merely cut at the bound would leave the others where the uncut step wanted them. Once the
/// others have settled, a held coordinate along which the cost falls into the range is let go again.
///
/// Settled: the Gauss-Newton step is less than a twentieth of a standard deviation (a tenth for @p rough descents), in
/// the metric of JᵀJ for points that err by themselves with their noise, or with their rms where that is larger.
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
