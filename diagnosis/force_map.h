// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "calibration/evaluator.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {

/// A field of forces on the skin that would explain what a model leaves: a picture of where something pulls or pushes
/// that the model does not have, and no more than that. A stiffness that is wrong inside, or a scan that lies
/// elsewhere, is turned into forces as well.
struct ForceMap {
  Points force_kpa;          ///< #R by 3, at the residuals' scan points; per deformed area, LPS
  Points null_kpa;           ///< the same of one simulated measurement of a model that lacks nothing
  double threshold_kpa = 0;  ///< 95 of 100 such measurements have nothing larger anywhere
  double evidence_gain = 0;  ///< ln evidence over "no forces", at the amplitude that makes most of it
  double amplitude_kpa = 0;  ///< that amplitude, prior standard deviation of each component
  double null_gain = 0;      ///< gain that 95 of 100 simulated measurements stay below
};

/// Tractions t(y) = Σ_c exp(−|y − y_c|²/2w²) a_c over up to 60 centres spread over the skin, w their spacing; a_c ~
/// N(0, τ²). Each acts as a dead load in its pose alone, so that distances follow through one linear solve with that
/// pose's tangent; what the free parameters can absorb is taken out; τ maximises the evidence (type II maximum
/// likelihood). The null is @p draws of whitened noise through the same, with the τ of the measurement (or their own,
/// where larger): the level that noise alone reaches in a map as free as this one. Only the first fitted pose is looked
/// at.
/// @throws NumericalFailure  the tangent of a pose is singular
ForceMap force_map(const calibration::MeasuredScene& scene, const simulation::Model& model, const calibration::Fit& f,
                   const Metric& metric, unsigned seed, int draws = 100);

}  // namespace supine::diagnosis
