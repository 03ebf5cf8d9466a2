// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "simulation/solve/spd_solver.h"

namespace supine::simulation {

/// Cholesky factors of symmetric matrices with 3 by 3 node blocks; one analysis, many numeric factorisations.
/// BLAS runs on one thread, so that results do not depend on the number of threads.
class CholeskySolver : public SpdSolver {
 public:
  explicit CholeskySolver(const SparseMatrix& pattern);
  ~CholeskySolver() override;
  bool factorise(const SparseMatrix& matrix, double shift = 0) override;
  void solve(const Eigen::VectorXd& right_hand_side, Eigen::VectorXd& solution) const override;
  Eigen::VectorXd solve(const Eigen::VectorXd& right_hand_side) const;
  double solves_per_factor() const override;
  bool direct() const override { return true; }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// LU factors of unsymmetric matrices with a symmetric pattern; one analysis, many numeric factorisations.
class LuSolver {
 public:
  explicit LuSolver(const SparseMatrix& pattern);
  ~LuSolver();
  /// @return false when the matrix is singular
  bool factorise(const SparseMatrix& matrix);
  Eigen::VectorXd solve(const Eigen::VectorXd& right_hand_side) const;
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& right_hand_side) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Which BLAS is linked and how many threads it uses, for example "OpenBLAS 0.3.21, 1 thread".
std::string blas_description();

}  // namespace supine::simulation
