// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>

#include "simulation/solve/chain.h"

namespace supine::calibration {

/// What a solve may cost where the dearest that was of use took @p dearest (EquilibriumSolver::work()): beyond three
/// times that mostly no equilibrium is near.
constexpr int most_work_beside(int dearest) {
  constexpr int cost_share = 3, least_allowed = 50;  // the second: what any solve may take
  return std::max(least_allowed, cost_share * dearest);
}

/// Bounds what a trial of a fit may cost, for as long as it lives: one of which a solve costs more than
/// most_work_beside() is given up (NoEquilibrium).
class TrialLimit {
 public:
  /// @param dearest  work of the dearest solve of those that were of use (ChainSolution::dearest_solve)
  TrialLimit(simulation::Chain& chain, int dearest) : chain_(chain) {
    chain.limit_each_solve(most_work_beside(dearest));
  }
  ~TrialLimit() { chain_.limit_each_solve({}); }
  TrialLimit(const TrialLimit&) = delete;
  TrialLimit& operator=(const TrialLimit&) = delete;

 private:
  simulation::Chain& chain_;
};

}  // namespace supine::calibration
