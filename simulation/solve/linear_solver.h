// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "simulation/solve/spd_solver.h"

namespace supine::simulation {

/// Cholesky factors of symmetric matrices with 3 by 3 node blocks; one analysis, many numeric factorisations.
/// BLAS runs on one thread, so that results do not depend on the number of threads.
/// @pre  factorise() returned true before any solve()
class CholeskySolver : public SpdSolver {
 public:
  /// @param pattern  as Pattern::zero_matrix() makes it, 3 #N by 3 #N; values are not read
  /// @throws NumericalFailure  out of memory
  explicit CholeskySolver(const SparseMatrix& pattern);
  ~CholeskySolver() override;
  /// @throws NumericalFailure  out of memory
  bool factorise(const SparseMatrix& matrix, double shift = 0) override;
  /// Not from two threads at once: the work space is the object's.
  void solve(const Eigen::VectorXd& right_hand_side, Eigen::VectorXd& solution) const override;
  /// Of every column of @p right_hand_sides, on all threads: a column costs a fraction of a solve by itself.
  /// @return the same bytes for any number of threads
  /// @throws NumericalFailure  out of memory
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right_hand_sides) const;
  double solves_per_factor() const override;
  bool direct() const override { return true; }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// LU factors of unsymmetric matrices with a symmetric pattern; one analysis, many numeric factorisations.
/// @pre  factorise() returned true before any solve
class LuSolver {
 public:
  /// @param pattern  as CholeskySolver takes it
  /// @throws NumericalFailure  out of memory
  explicit LuSolver(const SparseMatrix& pattern);
  ~LuSolver();
  /// @param matrix  with the pattern given to the constructor; copied
  /// @return false when the matrix is singular, or memory ran out
  bool factorise(const SparseMatrix& matrix);
  /// A⁻¹ of every column of @p right_hand_sides, on all threads.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right_hand_sides) const;
  /// A⁻ᵀ right_hand_side
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& right_hand_side) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Which BLAS is linked and how many threads it uses, for example "OpenBLAS 0.3.21, 1 thread".
std::string blas_description();

}  // namespace supine::simulation
