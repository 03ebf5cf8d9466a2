// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/linear_solver.h"

#include <omp.h>

#include <Eigen/CholmodSupport>
#include <Eigen/UmfPackSupport>

extern "C" {
void openblas_set_num_threads(int threads);
char* openblas_get_config(void);
int openblas_get_num_threads(void);
}

namespace supine::simulation {
namespace {

void use_one_blas_thread() { openblas_set_num_threads(1); }

/// CHOLMOD asks for four threads whatever OMP_NUM_THREADS says; on two cores they cost more than they give.
class SingleThreaded {
 public:
  SingleThreaded() : levels_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }
  ~SingleThreaded() { omp_set_max_active_levels(levels_); }
  SingleThreaded(const SingleThreaded&) = delete;
  SingleThreaded& operator=(const SingleThreaded&) = delete;

 private:
  int levels_;
};

}  // namespace

struct CholeskySolver::State {
  Eigen::CholmodSupernodalLLT<SparseMatrix, Eigen::Lower> solver;
};

CholeskySolver::CholeskySolver(const SparseMatrix& pattern) : state_(std::make_unique<State>()) {
  use_one_blas_thread();
  state_->solver.cholmod().print = 0;
  state_->solver.analyzePattern(pattern);
}

CholeskySolver::~CholeskySolver() = default;

bool CholeskySolver::factorise(const SparseMatrix& matrix, double shift) {
  const SingleThreaded guard;
  state_->solver.setShift(shift);
  state_->solver.factorize(matrix);
  return state_->solver.info() == Eigen::Success;
}

Eigen::VectorXd CholeskySolver::solve(const Eigen::VectorXd& right_hand_side) const {
  const SingleThreaded guard;
  return state_->solver.solve(right_hand_side);
}

struct LuSolver::State {
  Eigen::UmfPackLU<SparseMatrix> solver;
};

LuSolver::LuSolver(const SparseMatrix& pattern) : state_(std::make_unique<State>()) {
  use_one_blas_thread();
  // The pattern is symmetric and the diagonal strong: order for that.
  state_->solver.umfpackControl()[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;
  state_->solver.umfpackControl()[UMFPACK_ORDERING] = UMFPACK_ORDERING_METIS;
  state_->solver.analyzePattern(pattern);
}

LuSolver::~LuSolver() = default;

bool LuSolver::factorise(const SparseMatrix& matrix) {
  state_->solver.factorize(matrix);
  return state_->solver.info() == Eigen::Success;
}

Eigen::VectorXd LuSolver::solve(const Eigen::VectorXd& right_hand_side) const {
  return state_->solver.solve(right_hand_side);
}

std::string blas_description() {
  use_one_blas_thread();
  return std::string(openblas_get_config()) + ", " + std::to_string(openblas_get_num_threads()) + " thread";
}

}  // namespace supine::simulation
