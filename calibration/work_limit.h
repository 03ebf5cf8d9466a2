// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>

#include "simulation/solve/chain.h"

namespace supine::calibration {

/// Bounds what a trial of a fit may cost, for as long as it lives: one of which a solve costs more than three times the
/// dearest that was of use is given up, because mostly no equilibrium is near (NoEquilibrium).
class TrialLimit {
 public:
  /// @param dearest  work of the dearest solve of those that were of use (ChainSolution::dearest_solve)
  TrialLimit(simulation::Chain& chain, int dearest) : chain_(chain) {
    constexpr int cost_share = 3, least_allowed = 50;  // the second: EquilibriumSolver::work() that any solve may take
    chain.limit_each_solve(std::max(least_allowed, cost_share * dearest));
  }
  ~TrialLimit() { chain_.limit_each_solve({}); }
  TrialLimit(const TrialLimit&) = delete;
  TrialLimit& operator=(const TrialLimit&) = delete;

 private:
  simulation::Chain& chain_;
};

}  // namespace supine::calibration
