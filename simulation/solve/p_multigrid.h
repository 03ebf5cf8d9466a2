// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/solve/spd_solver.h"

namespace supine::simulation {

/// Two levels for quadratic cells: one symmetric cycle of Gauss-Seidel sweeps over the 3 by 3 node blocks, in single
/// precision, around the exact solution on the linear cells of the same corners (Galerkin: Pᵀ K P, P the interpolation
/// of edge middles from their ends; Cholesky). Memory and time grow with the mesh, not faster, but for the factor of
/// the corners, of which there are an eighth. Rønquist and Patera, Spectral element multigrid, J. Sci. Comput. 1987.
/// Near incompressibility linear cells lock and the cycle with them: cells of ν > 0.48 want a factor.
class PMultigrid : public SpdSolver {
 public:
  /// @param pattern  as Pattern::zero_matrix() makes it, 3 #N by 3 #N; values are not read
  /// @param cells    #C by 10, VTK order
  /// @throws NumericalFailure  out of memory
  PMultigrid(const SparseMatrix& pattern, const Indices& cells);
  ~PMultigrid() override;
  /// False also where a diagonal block is not positive definite; what neither shows, conjugate gradients do.
  bool factorise(const SparseMatrix& matrix, double shift = 0) override;
  /// Not from two threads at once: the work space is the object's.
  void solve(const Eigen::VectorXd& right_hand_side, Eigen::VectorXd& solution) const override;
  double solves_per_factor() const override;
  bool direct() const override { return false; }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace supine::simulation
