// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/solve/spd_solver.h"

namespace supine::simulation {

/// Smoothed-aggregation algebraic multigrid (PETSc GAMG) with the six rigid-body modes as near null space: memory and
/// time grow with the mesh, not faster. Only in builds with PETSc.
/// @throws NumericalFailure  every member, with PETSc's message
class MultigridSolver : public SpdSolver {
 public:
  /// @param pattern  symmetric, 3 #N by 3 #N; values are not read   @param nodes  #N by 3, for the rigid-body modes
  MultigridSolver(const SparseMatrix& pattern, const Points& nodes);
  ~MultigridSolver() override;
  bool factorise(const SparseMatrix& matrix, double shift = 0) override;
  void solve(const Eigen::VectorXd& right_hand_side, Eigen::VectorXd& solution) const override;
  /// So many that NewtonDirection always tries the kept hierarchy first.
  double solves_per_factor() const override { return 40; }
  bool direct() const override { return false; }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace supine::simulation
