// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

#include "calibration/evaluator.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/discrepancy.h"

namespace supine::diagnosis {

/// Under this likeliest size (mm) a discrepancy is too small for its shapes to matter.
inline constexpr double least_size_of_mean_kernel_mm = 0.2;

/// A fit with its parameters and nuisances moved, in equilibrium there, and what unknown forces do to the distances.
struct MovedFit {
  simulation::Model model;
  calibration::Prediction prediction;
  Discrepancy discrepancy;
};
inline constexpr std::size_t kernel_draws = 4;

/// Moves a fit to each of kernel_draws draws from its posterior, the same ones whenever it is called.
/// @param base  with its covariance and the slopes of its numbers, from linearise()
/// @param look  called of each that has an equilibrium, with its number, of several at the same time
void look_at_draws(const calibration::MeasuredScene& scene, const BaseFit& base,
                   const std::function<void(std::size_t draw, const MovedFit& moved)>& look);

/// The covariance K of the discrepancy over the posterior of a fit: mean of that at the fit and those at the draws,
/// each with its own equilibria. How far an unknown force moves a body depends on the stiffness and the loads that are
/// themselves not known; K at the fit alone takes the shapes for certain, and the few per cent by which they are others
/// then count as evidence for whatever differs between poses (gravity, gradients, moduli). Draws without an equilibrium
/// are left out.
/// @param base  as of look_at_draws()
/// @return  as BaseFit::kernel
Eigen::MatrixXd mean_kernel(const calibration::MeasuredScene& scene, const BaseFit& base);

}  // namespace supine::diagnosis
