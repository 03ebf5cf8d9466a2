// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/linear_solver.h"

#include <omp.h>
#include <umfpack.h>

#include <Eigen/CholmodSupport>
#include <algorithm>
#include <deque>
#include <utility>
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

namespace {

/// What CHOLMOD works in, its space kept between solves.
struct Cholmod {
  cholmod_common common;
  cholmod_dense *solution = nullptr, *work1 = nullptr, *work2 = nullptr;

  Cholmod() {
    cholmod_start(&common);
    common.print = 0;
  }
  ~Cholmod() {
    for (cholmod_dense** dense : {&solution, &work1, &work2}) cholmod_free_dense(dense, &common);
    cholmod_finish(&common);
  }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;

  /// @param b  #dofs by #columns, dense
  /// @return false when memory ran out; else the solution is as large as @p b
  bool solve(cholmod_factor* factor, cholmod_dense b) {
    return cholmod_solve2(CHOLMOD_A, factor, &b, nullptr, &solution, nullptr, &work1, &work2, &common) != 0;
  }
  const double* values() const { return static_cast<const double*>(solution->x); }
};

}  // namespace

struct CholeskySolver::State {
  Cholmod own;
  cholmod_common& common = own.common;
  cholmod_factor* factor = nullptr;

  State() {
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.final_ll = true;
    common.quick_return_if_not_posdef = true;
  }
  ~State() { cholmod_free_factor(&factor, &common); }
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

/// Which nodes of a body are coupled, three consecutive dofs each: the lower triangle by columns.
struct NodeGraph {
  std::vector<int> first, rows;
  bool operator==(const NodeGraph&) const = default;
};

NodeGraph node_graph(const SparseMatrix& matrix) {
  const int nodes = static_cast<int>(matrix.cols() / 3);
  NodeGraph graph{std::vector<int>(nodes + 1, 0), {}};
  for (int n = 0; n < nodes; ++n) {
    for (SparseMatrix::InnerIterator entry(matrix, 3 * n); entry; ++entry)
      if (entry.row() % 3 == 0 && entry.row() / 3 >= n) graph.rows.push_back(static_cast<int>(entry.row() / 3));
    graph.first[n + 1] = static_cast<int>(graph.rows.size());
  }
  return graph;
}

/// Fill-reducing order of the dofs: ordering the graph of the nodes takes a ninth of the work that ordering the dofs
/// takes.
std::vector<int> ordered(NodeGraph& nodes) {
  Cholmod cholmod;
  const std::size_t count = nodes.first.size() - 1;
  cholmod_sparse graph{};
  graph.nrow = graph.ncol = count;
  graph.nzmax = nodes.rows.size();
  graph.p = nodes.first.data();
  graph.i = nodes.rows.data();
  graph.stype = lower_triangle;
  graph.itype = CHOLMOD_INT;
  graph.xtype = CHOLMOD_PATTERN;
  graph.sorted = graph.packed = 1;
  std::vector<int> node_order(count), order(3 * count);
  const bool found = cholmod_metis(&graph, nullptr, 0, true, node_order.data(), &cholmod.common) != 0;
  if (!found) throw NumericalFailure("METIS could not order the mesh: out of memory?");
  for (std::size_t n = 0; n < count; ++n)
    for (int i = 0; i < 3; ++i) order[3 * n + i] = 3 * node_order[n] + i;
  return order;
}

/// ordered(), of meshes seen lately from memory: a diagnosis makes the body of one mesh dozens of times.
std::vector<int> fill_reducing_order(const SparseMatrix& matrix) {
  constexpr std::size_t most = 6;
  static std::deque<std::pair<NodeGraph, std::vector<int>>> known;
  NodeGraph graph = node_graph(matrix);
  const std::lock_guard alone(shared_random);
  for (const auto& [seen, order] : known)
    if (seen == graph) return order;
  std::vector<int> order = ordered(graph);
  known.emplace_front(std::move(graph), order);
  if (known.size() > most) known.pop_back();
  return order;
}

}  // namespace

CholeskySolver::CholeskySolver(const SparseMatrix& pattern) : state_(std::make_unique<State>()) {
  use_one_blas_thread();
  const SingleThreaded guard;
  std::vector<int> order = fill_reducing_order(pattern);
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
  state_->own.solve(state_->factor, Eigen::viewAsCholmod(const_cast<Eigen::VectorXd&>(right_hand_side)));
  solution = Eigen::Map<const Eigen::VectorXd>(state_->own.values(), right_hand_side.size());
}

Eigen::MatrixXd CholeskySolver::solve(const Eigen::MatrixXd& right_hand_sides) const {
  constexpr Eigen::Index at_once = 16;  // of columns: enough for matrix products in place of products with vectors
  Eigen::MatrixXd solutions(right_hand_sides.rows(), right_hand_sides.cols());
  const auto blocks = (right_hand_sides.cols() + at_once - 1) / at_once;
  bool solved = true;
#pragma omp parallel if (blocks > 1)
  {
    const SingleThreaded guard;
    Cholmod space;
#pragma omp for schedule(dynamic, 1) reduction(&& : solved)
    for (Eigen::Index block = 0; block < blocks; ++block) {
      const Eigen::Index first = block * at_once, count = std::min(at_once, right_hand_sides.cols() - first);
      Eigen::Map<Eigen::MatrixXd> columns(const_cast<double*>(right_hand_sides.col(first).data()),
                                          right_hand_sides.rows(), count);
      const bool done = space.solve(state_->factor, Eigen::viewAsCholmod(columns));
      solved = solved && done;
      if (done)
        solutions.middleCols(first, count) = Eigen::Map<const Eigen::MatrixXd>(space.values(), solutions.rows(), count);
    }
  }
  if (!solved) throw NumericalFailure("a solve ran out of memory: use fewer tetrahedra");
  return solutions;
}

struct LuSolver::State {
  SparseMatrix matrix;  // kept: UMFPACK wants it again for every solve
  double control[UMFPACK_CONTROL];
  void *symbolic = nullptr, *numeric = nullptr;

  State() { umfpack_di_defaults(control); }
  ~State() {
    umfpack_di_free_numeric(&numeric);
    umfpack_di_free_symbolic(&symbolic);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void solve_system(int system, const double* b, double* x) const {
    umfpack_di_solve(system, matrix.outerIndexPtr(), matrix.innerIndexPtr(), matrix.valuePtr(), x, b, numeric, control,
                     nullptr);
  }
};

LuSolver::LuSolver(const SparseMatrix& pattern) : state_(std::make_unique<State>()) {
  use_one_blas_thread();
  // The pattern is symmetric and the diagonal strong: order for that.
  state_->control[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;
  state_->control[UMFPACK_IRSTEP] = 0;  // refinement triples the cost of a solve and is not needed
  state_->matrix = pattern;
  // By the pattern alone: what comes out later must not depend on the numbers of the first matrix.
  state_->matrix.coeffs() = 1;
  const std::vector<int> order = fill_reducing_order(pattern);
  const SparseMatrix& m = state_->matrix;
  const int size = static_cast<int>(m.cols());
  if (umfpack_di_qsymbolic(size, size, m.outerIndexPtr(), m.innerIndexPtr(), m.valuePtr(), order.data(),
                           &state_->symbolic, state_->control, nullptr) < 0)
    throw NumericalFailure("UMFPACK could not analyse the mesh: out of memory?");
}

LuSolver::~LuSolver() = default;

bool LuSolver::factorise(const SparseMatrix& matrix) {
  state_->matrix = matrix;
  state_->matrix.makeCompressed();
  umfpack_di_free_numeric(&state_->numeric);
  const SparseMatrix& m = state_->matrix;
  return umfpack_di_numeric(m.outerIndexPtr(), m.innerIndexPtr(), m.valuePtr(), state_->symbolic, &state_->numeric,
                            state_->control, nullptr) == UMFPACK_OK;
}

Eigen::MatrixXd LuSolver::solve(const Eigen::MatrixXd& right_hand_sides) const {
  Eigen::MatrixXd solutions(right_hand_sides.rows(), right_hand_sides.cols());
#pragma omp parallel for schedule(dynamic, 1) if (right_hand_sides.cols() > 1)
  for (Eigen::Index k = 0; k < right_hand_sides.cols(); ++k)
    state_->solve_system(UMFPACK_A, right_hand_sides.col(k).data(), solutions.col(k).data());
  return solutions;
}

Eigen::VectorXd LuSolver::solve_transposed(const Eigen::VectorXd& right_hand_side) const {
  Eigen::VectorXd solution(right_hand_side.size());
  state_->solve_system(UMFPACK_At, right_hand_side.data(), solution.data());
  return solution;
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
