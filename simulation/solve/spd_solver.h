// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>

#include "simulation/elements/assembly.h"

namespace supine::simulation {

/// Inverse, exact or approximate, of symmetric positive definite matrices with 3 by 3 node blocks and one pattern: the
/// direct solver of small meshes, the preconditioner of Krylov solvers on large ones.
class SpdSolver {
 public:
  virtual ~SpdSolver() = default;
  /// Takes over K + shift I (the lower triangle of K is read).
  /// @param matrix  K, with the pattern the solver was made for   @param shift  in K's units, >= 0
  /// @return false when that is found not to be positive definite; solve() must then not be called
  virtual bool factorise(const SparseMatrix& matrix, double shift = 0) = 0;
  /// solution ≈ (K + shift I)⁻¹ right_hand_side: to rounding when direct(), else one symmetric cycle.
  virtual void solve(const Eigen::VectorXd& right_hand_side, Eigen::VectorXd& solution) const = 0;
  /// How many solves cost about as much as one factorisation, by the operations they take: a number of the matrix, not
  /// of the machine's mood.
  virtual double solves_per_factor() const = 0;
  /// Whether solve() is exact to rounding.
  virtual bool direct() const = 0;
};

/// The solver that suits the mesh: Cholesky as long as its factor is affordable, beyond that algebraic multigrid with
/// rigid-body modes where the program was built with PETSc (Cholesky where it was not).
/// @param pattern  as Pattern::zero_matrix() makes it, 3 #N by 3 #N; values are not read
/// @param nodes  #N by 3, for the rigid-body modes
/// @throws NumericalFailure  out of memory
std::unique_ptr<SpdSolver> make_spd_solver(const SparseMatrix& pattern, const Points& nodes);

}  // namespace supine::simulation
