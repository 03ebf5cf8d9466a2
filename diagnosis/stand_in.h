// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "simulation/solve/chain.h"

namespace supine::calibration {
struct MeasuredScene;
}

namespace supine::diagnosis {

struct BaseFit;
struct Candidate;
struct Priors;
class FitErrors;

/// A number that makes up for an effect.
struct MadeUp {
  std::string name, unit;
  double from, to;
};

/// A model with an effect at its usual size that does what the base model does, as nearly as it can: all that is free
/// was fitted to that, through the whole chain. What is left of the effect is all that the points can show of it.
struct StandIn {
  simulation::Model model;
  simulation::ChainSolution solution;
  Eigen::VectorXd left_mm;  ///< #R, change of the distances
  std::vector<MadeUp> made_up;
};

/// Fills Candidate::stand_in of effects of one number where straight lines promise too much. What makes up for an
/// effect far from its null goes along other lines than at its null (a bar whose clamp turns by degrees lies where a
/// softer one in a rigid clamp does, but not to first order), so lines are drawn at its usual size too. Where these
/// leave less than half of what the first leave, free parameters are fitted until the points lie where the base model
/// has them, nuisances and discrepancy as errors. Of an effect that the case expects no lines are asked, and the others
/// that it expects are free too. Of a number of either sign the one that is seen less counts. Where the
/// chain finds no equilibrium, or none that costs as little as the dearest of the base fit, none is filled.
void find_stand_ins(const calibration::MeasuredScene& scene, const BaseFit& base, const FitErrors& errors,
                    const Priors& priors, std::vector<Candidate>& candidates);

}  // namespace supine::diagnosis
