// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "simulation/assembly.h"

namespace supine::simulation {

/// Direct solvers that keep their symbolic analysis: one pattern, many numeric factorisations.
/// BLAS runs on one thread, so that results do not depend on the number of threads.
class CholeskySolver {
 public:
  explicit CholeskySolver(const SparseMatrix& pattern);
  ~CholeskySolver();
  /// Factorises K + shift I (lower triangle read). @return false when that is not positive definite
  bool factorise(const SparseMatrix& matrix, double shift = 0);
  Eigen::VectorXd solve(const Eigen::VectorXd& right_hand_side) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

class LuSolver {
 public:
  explicit LuSolver(const SparseMatrix& pattern);
  ~LuSolver();
  /// @return false when the matrix is singular
  bool factorise(const SparseMatrix& matrix);
  Eigen::VectorXd solve(const Eigen::VectorXd& right_hand_side) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Which BLAS is linked and how many threads it uses, for example "OpenBLAS 0.3.21, 1 thread".
std::string blas_description();

}  // namespace supine::simulation
