// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/evidence/hypotheses.h"

namespace supine::diagnosis {

/// The effect with its strengths free from @ref strength_prior and its place and shape free from the catalogue's
/// priors.
simulation::EffectSetting free_setting(const std::string& effect);

/// The model with a set of effects, all free, to be fitted from where an earlier fit has nuisances; its numbers are
/// the prior's.
JointFit unfitted(const simulation::Model& given, const BaseFit& base, const JointFit& from,
                  const std::vector<std::string>& effects);

/// Coordinates to begin with: those of numbers that the base fit has too, else the prior's.
Eigen::VectorXd start_at(const JointFit& set, const BaseFit& base);

/// Fills the hypothesis of a fit: Laplace's evidence at the optimum.
void weigh_at(const BaseFit& base, const JointFit& fit, Hypothesis& h);

/// Fits a set with Gauss–Newton in its numbers and the nuisances, and weighs it there.
/// @param joint  in: unfitted; out: where it ended
/// @param near   to start from, or nullptr
/// @throws NumericalFailure  no equilibrium at the start
void fit_jointly(const calibration::MeasuredScene& scene, const BaseFit& base, const JointTrial& start,
                 const simulation::ChainSolution* near, int most_steps, JointFit& joint, Hypothesis& h);

/// Singles whose strength is far from linear (strength_profile.h), weighed along straight lines from the model that has
/// them at their usual size, after a few steps towards the measured distances: a ligament changes what the moduli do,
/// and lines from a breast without it say nothing of that. Kept where that says more than lines from nothing;
/// Hypothesis::from_usual then.
/// @param skipped  effects that are not looked at
void weigh_from_usual_size(const calibration::MeasuredScene& scene, const simulation::Model& given, const BaseFit& base,
                           const std::vector<Candidate>& candidates, const std::vector<std::string>& skipped,
                           std::vector<Hypothesis>& hypotheses);

}  // namespace supine::diagnosis
