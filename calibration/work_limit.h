// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>

#include "simulation/solve/chain.h"

namespace supine::calibration {

/// Bounds what a trial of a fit may cost, for as long as it lives: one that costs more than three times the dearest
/// that was of use is given up, because mostly no equilibrium is near (NoEquilibrium).
class TrialLimit {
 public:
  /// @param dearest  work of the dearest solution that was of use (ChainSolution::work)
  TrialLimit(simulation::Chain& chain, int dearest) : chain_(chain) {
    constexpr int cost_share = 3, least_allowed = 100;  // the second: EquilibriumSolver::work() that any may take
    chain.limit_work(std::max(least_allowed, cost_share * dearest));
  }
  ~TrialLimit() { chain_.limit_work({}); }
  TrialLimit(const TrialLimit&) = delete;
  TrialLimit& operator=(const TrialLimit&) = delete;

 private:
  simulation::Chain& chain_;
};

}  // namespace supine::calibration
