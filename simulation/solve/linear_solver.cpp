// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/linear_solver.h"

#include <omp.h>

#include <Eigen/CholmodSupport>
#include <Eigen/UmfPackSupport>
#include <vector>

#include "common/error.h"
#include "common/shared_random.h"
#ifdef SUPINE_WITH_PETSC
#include "simulation/solve/multigrid_solver.h"
#endif

extern "C" {
void openblas_set_num_threads(int threads);
char* openblas_get_config(void);
int openblas_get_num_threads(void);
}

namespace supine::simulation {
namespace {

// A factorisation works in cache, a solve fetches every entry twice, and a Krylov iteration takes more than the solve:
// measured, in floating-point operations per entry of the factor.
constexpr double operations_per_fetch = 80;

#ifdef SUPINE_WITH_PETSC
// Dofs. Where a Cholesky factor takes about ten seconds and two gigabytes a multigrid cycle is cheaper many times over.
constexpr Eigen::Index largest_direct = 100'000;
#endif

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
  cholmod_common common;
  cholmod_factor* factor = nullptr;
  // Workspace of cholmod_solve2, kept between solves.
  cholmod_dense *solution = nullptr, *work1 = nullptr, *work2 = nullptr;

  State() {
    cholmod_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.final_ll = true;
    common.quick_return_if_not_posdef = true;
  }
  ~State() {
    for (cholmod_dense** dense : {&solution, &work1, &work2}) cholmod_free_dense(dense, &common);
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

namespace {

constexpr int lower_triangle = -1;  // cholmod_sparse::stype: symmetric, only that triangle is read

/// The lower triangle of @p matrix as CHOLMOD sees it; the data are not copied.
cholmod_sparse lower_view(const SparseMatrix& matrix) {
  cholmod_sparse view = Eigen::viewAsCholmod(const_cast<SparseMatrix&>(matrix));
  view.stype = lower_triangle;
  return view;
}

/// Fill-reducing order of the nodes, three consecutive dofs each: ordering the graph of the nodes takes a ninth of the
/// work that ordering the dofs takes.
std::vector<int> node_ordering(const SparseMatrix& matrix, cholmod_common& common) {
  const int nodes = static_cast<int>(matrix.cols() / 3);
  std::vector<int> first(nodes + 1, 0), rows;
  for (int n = 0; n < nodes; ++n) {
    for (SparseMatrix::InnerIterator entry(matrix, 3 * n); entry; ++entry)
      if (entry.row() % 3 == 0 && entry.row() / 3 >= n) rows.push_back(static_cast<int>(entry.row() / 3));
    first[n + 1] = static_cast<int>(rows.size());
  }
  cholmod_sparse graph{};
  graph.nrow = graph.ncol = static_cast<std::size_t>(nodes);
  graph.nzmax = rows.size();
  graph.p = first.data();
  graph.i = rows.data();
  graph.stype = lower_triangle;
  graph.itype = CHOLMOD_INT;
  graph.xtype = CHOLMOD_PATTERN;
  graph.sorted = graph.packed = 1;
  std::vector<int> node_order(nodes), order(3 * static_cast<std::size_t>(nodes));
  if (!cholmod_metis(&graph, nullptr, 0, true, node_order.data(), &common))
    throw NumericalFailure("METIS could not order the mesh: out of memory?");
  for (int n = 0; n < nodes; ++n)
    for (int i = 0; i < 3; ++i) order[3 * static_cast<std::size_t>(n) + i] = 3 * node_order[n] + i;
  return order;
}

}  // namespace

CholeskySolver::CholeskySolver(const SparseMatrix& pattern) : state_(std::make_unique<State>()) {
  use_one_blas_thread();
  const SingleThreaded guard;
  const std::lock_guard alone(shared_random);
  std::vector<int> order = node_ordering(pattern, state_->common);
  state_->common.nmethods = 1;
  state_->common.method[0].ordering = CHOLMOD_GIVEN;
  cholmod_sparse view = lower_view(pattern);
  state_->factor = cholmod_analyze_p(&view, order.data(), nullptr, 0, &state_->common);
  if (state_->factor == nullptr) throw NumericalFailure("CHOLMOD could not analyse the mesh: out of memory?");
}

CholeskySolver::~CholeskySolver() = default;

double CholeskySolver::solves_per_factor() const {
  return state_->common.lnz > 0 ? state_->common.fl / (operations_per_fetch * state_->common.lnz) : 1;
}

bool CholeskySolver::factorise(const SparseMatrix& matrix, double shift) {
  const SingleThreaded guard;
  cholmod_sparse view = lower_view(matrix);
  double beta[2] = {shift, 0};
  cholmod_factorize_p(&view, beta, nullptr, 0, state_->factor, &state_->common);
  if (state_->common.status < 0) throw NumericalFailure("the factorisation ran out of memory: use fewer tetrahedra");
  return state_->common.status == CHOLMOD_OK && state_->factor->minor == state_->factor->n;
}

void CholeskySolver::solve(const Eigen::VectorXd& right_hand_side, Eigen::VectorXd& solution) const {
  const SingleThreaded guard;
  cholmod_dense b = Eigen::viewAsCholmod(const_cast<Eigen::VectorXd&>(right_hand_side));
  cholmod_solve2(CHOLMOD_A, state_->factor, &b, nullptr, &state_->solution, nullptr, &state_->work1, &state_->work2,
                 &state_->common);
  solution = Eigen::Map<const Eigen::VectorXd>(static_cast<const double*>(state_->solution->x), right_hand_side.size());
}

Eigen::VectorXd CholeskySolver::solve(const Eigen::VectorXd& right_hand_side) const {
  Eigen::VectorXd solution(right_hand_side.size());
  solve(right_hand_side, solution);
  return solution;
}

struct LuSolver::State {
  struct Solver : Eigen::UmfPackLU<SparseMatrix> {
    Eigen::VectorXd solve_system(int system, const Eigen::VectorXd& b) const {
      Eigen::VectorXd x(b.size());
      umfpack_di_solve(system, mp_matrix.outerIndexPtr(), mp_matrix.innerIndexPtr(), mp_matrix.valuePtr(), x.data(),
                       b.data(), m_numeric, m_control.data(), nullptr);
      return x;
    }
  } solver;
  SparseMatrix matrix;  // kept: UMFPACK wants it again for every solve
};

LuSolver::LuSolver(const SparseMatrix& pattern) : state_(std::make_unique<State>()) {
  use_one_blas_thread();
  // The pattern is symmetric and the diagonal strong: order for that.
  state_->solver.umfpackControl()[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;
  state_->solver.umfpackControl()[UMFPACK_ORDERING] = UMFPACK_ORDERING_METIS;
  state_->solver.umfpackControl()[UMFPACK_IRSTEP] = 0;  // refinement triples the cost of a solve and is not needed
  state_->matrix = pattern;
  // By the pattern alone: what comes out later must not depend on the numbers of the first matrix.
  state_->matrix.coeffs() = 1;
  const std::lock_guard alone(shared_random);
  state_->solver.analyzePattern(state_->matrix);
}

LuSolver::~LuSolver() = default;

bool LuSolver::factorise(const SparseMatrix& matrix) {
  state_->matrix = matrix;
  state_->solver.factorize(state_->matrix);
  return state_->solver.info() == Eigen::Success;
}

Eigen::VectorXd LuSolver::solve(const Eigen::VectorXd& right_hand_side) const {
  return state_->solver.solve_system(UMFPACK_A, right_hand_side);
}

Eigen::VectorXd LuSolver::solve_transposed(const Eigen::VectorXd& right_hand_side) const {
  return state_->solver.solve_system(UMFPACK_At, right_hand_side);
}

std::unique_ptr<SpdSolver> make_spd_solver(const SparseMatrix& pattern, [[maybe_unused]] const Points& nodes) {
#ifdef SUPINE_WITH_PETSC
  if (pattern.cols() > largest_direct) return std::make_unique<MultigridSolver>(pattern, nodes);
#endif
  return std::make_unique<CholeskySolver>(pattern);
}

std::string blas_description() {
  use_one_blas_thread();
  return std::string(openblas_get_config()) + ", " + std::to_string(openblas_get_num_threads()) + " thread";
}

}  // namespace supine::simulation
