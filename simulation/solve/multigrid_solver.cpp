// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/multigrid_solver.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <vector>

#include "common/error.h"

namespace supine::simulation {
namespace {

void check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  PetscErrorMessage(code, &text, nullptr);
  throw NumericalFailure(fmt::format("PETSc failed: {} (code {})", text == nullptr ? "unknown" : text, code));
}

/// PETSc lives from its first use to the end of the program.
void start_petsc() {
  static const bool started = [] {
    check(PetscInitializeNoArguments());
    check(PetscPopSignalHandler());  // an interrupt is the program's own business
    check(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
    // Symmetric smoothing, so that conjugate gradients may use a cycle as preconditioner.
    for (const auto& [key, value] :
         {std::pair{"-supine_mg_levels_ksp_type", "chebyshev"}, std::pair{"-supine_mg_levels_pc_type", "jacobi"},
          std::pair{"-supine_mg_levels_ksp_max_it", "3"}, std::pair{"-supine_mg_coarse_pc_type", "cholesky"}})
      check(PetscOptionsSetValue(nullptr, key, value));
    return true;
  }();
  (void)started;
}

}  // namespace

struct MultigridSolver::State {
  std::vector<PetscInt> first, column;
  std::vector<PetscScalar> value;  // a copy: the cycle must not change while the caller assembles anew
  Mat matrix = nullptr;
  PC cycle = nullptr;
  Vec in = nullptr, out = nullptr;
  ~State() {
    PCDestroy(&cycle);
    MatDestroy(&matrix);
    VecDestroy(&in);
    VecDestroy(&out);
  }
};

MultigridSolver::MultigridSolver(const SparseMatrix& pattern, const Points& nodes) : state_(std::make_unique<State>()) {
  start_petsc();
  State& s = *state_;
  const auto size = static_cast<PetscInt>(pattern.cols());
  s.first.assign(pattern.outerIndexPtr(), pattern.outerIndexPtr() + size + 1);
  s.column.assign(pattern.innerIndexPtr(), pattern.innerIndexPtr() + pattern.nonZeros());
  s.value.assign(static_cast<std::size_t>(pattern.nonZeros()), 0.0);
  // Symmetric: its columns serve as rows.
  check(MatCreateSeqAIJWithArrays(PETSC_COMM_SELF, size, size, s.first.data(), s.column.data(), s.value.data(),
                                  &s.matrix));
  check(MatSetBlockSize(s.matrix, 3));
  check(MatSetOption(s.matrix, MAT_SPD, PETSC_TRUE));
  Vec coordinates = nullptr;
  check(VecCreateSeq(PETSC_COMM_SELF, size, &coordinates));
  check(VecSetBlockSize(coordinates, 3));
  PetscScalar* entries = nullptr;
  check(VecGetArray(coordinates, &entries));
  std::copy_n(nodes.data(), size, entries);
  check(VecRestoreArray(coordinates, &entries));
  MatNullSpace rigid = nullptr;
  check(MatNullSpaceCreateRigidBody(coordinates, &rigid));
  check(MatSetNearNullSpace(s.matrix, rigid));
  check(MatNullSpaceDestroy(&rigid));
  check(VecDestroy(&coordinates));
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 3, size, nullptr, &s.in));
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 3, size, nullptr, &s.out));
}

MultigridSolver::~MultigridSolver() = default;

bool MultigridSolver::factorise(const SparseMatrix& matrix, double shift) {
  State& s = *state_;
  PetscScalar* entries = nullptr;
  check(MatSeqAIJGetArray(s.matrix, &entries));
  std::copy_n(matrix.valuePtr(), matrix.nonZeros(), entries);
  check(MatSeqAIJRestoreArray(s.matrix, &entries));
  if (shift != 0) check(MatShift(s.matrix, shift));
  if (s.cycle == nullptr) {
    check(PCCreate(PETSC_COMM_SELF, &s.cycle));
    check(PCSetType(s.cycle, PCGAMG));
    check(PCSetOptionsPrefix(s.cycle, "supine_"));
    check(PCGAMGSetReuseInterpolation(s.cycle, PETSC_TRUE));
    check(PCSetFromOptions(s.cycle));
  }
  check(PCSetOperators(s.cycle, s.matrix, s.matrix));
  return PCSetUp(s.cycle) == 0;  // the coarsest level is factorised: that may fail where K is not positive definite
}

void MultigridSolver::solve(const Eigen::VectorXd& right_hand_side, Eigen::VectorXd& solution) const {
  State& s = *state_;
  solution.resize(right_hand_side.size());
  check(VecPlaceArray(s.in, right_hand_side.data()));
  check(VecPlaceArray(s.out, solution.data()));
  check(PCApply(s.cycle, s.in, s.out));
  check(VecResetArray(s.in));
  check(VecResetArray(s.out));
}

}  // namespace supine::simulation
