// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "calibration/evaluator.h"
#include "diagnosis/evidence/base_fit.h"

namespace supine::diagnosis {

/// Under this likeliest size (mm) a discrepancy is too small for its shapes to matter.
inline constexpr double least_size_of_mean_kernel_mm = 0.2;

/// The covariance K of the discrepancy over the posterior of a fit: mean of that at the fit and those at a few draws of
/// its parameters and nuisances, each with its own equilibria. How far an unknown force moves a body depends on the
/// stiffness and the loads that are themselves not known; K at the fit alone takes the shapes for certain, and the few
/// per cent by which they are others then count as evidence for whatever differs between poses (gravity, gradients,
/// moduli). Draws without an equilibrium are left out.
/// @param base  with its covariance and the slopes of its numbers, from linearise()
/// @return  as BaseFit::kernel
Eigen::MatrixXd mean_kernel(const calibration::MeasuredScene& scene, const BaseFit& base);

}  // namespace supine::diagnosis
