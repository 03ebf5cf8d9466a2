// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/p_multigrid.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <numeric>
#include <vector>

#include "simulation/solve/linear_solver.h"

namespace supine::simulation {
namespace {

// Setting up is a copy of the matrix, its product with the interpolation and a factor of an eighth of the unknowns.
constexpr double measured_solves_per_setup = 8;

constexpr std::array<std::array<int, 2>, 6> vtk_edges = {{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};

/// Which corners a node is the mean of, in the numbering of the corners alone; a corner is the mean of itself, twice.
struct Corners {
  std::vector<std::array<int, 2>> parents;  // per node
  int count = 0;

  Corners(const Indices& quadratic, Eigen::Index nodes) : parents(static_cast<std::size_t>(nodes), {-1, -1}) {
    std::vector<int> number(static_cast<std::size_t>(nodes), -1);
    for (const int node : quadratic.leftCols(4).reshaped()) number[node] = 0;
    for (int& corner : number)
      if (corner == 0) corner = count++;
    for (Eigen::Index c = 0; c < quadratic.rows(); ++c) {
      for (int a = 0; a < 4; ++a) parents[quadratic(c, a)].fill(number[quadratic(c, a)]);
      for (int e = 0; e < 6; ++e)
        parents[quadratic(c, 4 + e)] = {number[quadratic(c, vtk_edges[e][0])], number[quadratic(c, vtk_edges[e][1])]};
    }
  }

  /// Corners coupled with each, where nodes are coupled as in @p pattern.
  std::vector<std::vector<int>> adjacent(const SparseMatrix& pattern) const {
    std::vector<std::vector<int>> corners(count);
    for (int b = 0; b < static_cast<int>(parents.size()); ++b)
      for (SparseMatrix::InnerIterator entry(pattern, 3 * b); entry; ++entry)
        if (entry.row() % 3 == 0)
          for (const int from : parents[b])
            for (const int to : parents[entry.row() / 3]) corners[from].push_back(to);
    return corners;
  }
};

constexpr int floats_per_line = 16;  // of cache

/// Three rows of a matrix, @p stride apart, times a vector: all at once, so that their fetches overlap.
Eigen::Vector3f three_rows(const float* rows, int stride, const float* vector, int size) {
  const float *second = rows + stride, *third = second + stride;
  float a = 0, b = 0, c = 0;
#pragma omp simd reduction(+ : a, b, c)
  for (int i = 0; i < size; ++i) {
    a += rows[i] * vector[i];
    b += second[i] * vector[i];
    c += third[i] * vector[i];
  }
  return {a, b, c};
}

}  // namespace

struct PMultigrid::State {
  int nodes;
  std::vector<int> first, neighbour, middle;  // node blocks of each column, sorted; where the diagonal one is
  std::vector<float> value;                   // as in the matrix
  std::vector<Eigen::Matrix3f> inverse_diagonal;
  Corners corners;
  Pattern corner_pattern;
  SparseMatrix corner_matrix;
  std::vector<std::array<int, 4>> target;  // per node block: value offsets of the corner blocks it adds to
  CholeskySolver corner_factor;
  mutable std::vector<float> f, x, r, gathered;
  mutable Eigen::VectorXd corner_force, corner_step;

  State(const SparseMatrix& pattern, const Indices& cells)
      : nodes(static_cast<int>(pattern.cols() / 3)),
        corners(cells, nodes),
        corner_pattern(corners.adjacent(pattern)),
        corner_matrix(corner_pattern.zero_matrix()),
        corner_factor(corner_matrix) {
    int most = 0;
    first.push_back(0);
    for (int b = 0; b < nodes; ++b) {
      for (SparseMatrix::InnerIterator entry(pattern, 3 * b); entry; ++entry) {
        const int a = static_cast<int>(entry.row()) / 3;
        if (entry.row() % 3 != 0) continue;
        if (a == b) middle.push_back(static_cast<int>(neighbour.size()) - first.back());
        neighbour.push_back(a);
        std::array<int, 4> to{};
        for (int i = 0; i < 4; ++i) to[i] = corner_pattern.block(corners.parents[a][i % 2], corners.parents[b][i / 2]);
        target.push_back(to);
      }
      first.push_back(static_cast<int>(neighbour.size()));
      most = std::max(most, first[b + 1] - first[b]);
    }
    value.resize(static_cast<std::size_t>(pattern.nonZeros()));
    inverse_diagonal.resize(nodes);
    gathered.resize(3 * static_cast<std::size_t>(most));
    for (auto* vector : {&f, &x, &r}) vector->resize(3 * static_cast<std::size_t>(nodes));
    corner_force.resize(corner_pattern.dofs());
  }

  /// Σ over the neighbours [from, to) of node @p b of block (b, a) x_a.
  Eigen::Vector3f product(int b, int from, int to) const {
    const int blocks = first[b + 1] - first[b], size = 3 * (to - from);
    const int* at = neighbour.data() + first[b];
    for (int s = from; s < to; ++s)
      for (int i = 0; i < 3; ++i) gathered[3 * (s - from) + i] = x[3 * static_cast<std::size_t>(at[s]) + i];
    const float* column = value.data() + 9 * static_cast<std::size_t>(first[b]) + 3 * from;
    return three_rows(column, 3 * blocks, gathered.data(), size);
  }

  /// Fetches the blocks of node @p b into cache: a sweep against the order of memory would wait for each.
  void fetch(int b) const {
    const float* end = value.data() + 9 * static_cast<std::size_t>(first[b + 1]);
    for (const float* at = value.data() + 9 * static_cast<std::size_t>(first[b]); at < end; at += floats_per_line)
      __builtin_prefetch(at);
  }

  static Eigen::Map<Eigen::Vector3f> at(std::vector<float>& vector, int node) {
    return Eigen::Map<Eigen::Vector3f>(vector.data() + 3 * static_cast<std::size_t>(node));
  }

  bool invert_diagonal(const SparseMatrix& matrix, double shift);
  void restrict_matrix(const SparseMatrix& matrix, double shift);
  void correct_on_corners() const;
};

/// False where a block is not positive definite.
bool PMultigrid::State::invert_diagonal(const SparseMatrix& matrix, double shift) {
  for (int b = 0; b < nodes; ++b) {
    const int blocks = first[b + 1] - first[b];
    const double* entries = matrix.valuePtr() + 9 * static_cast<std::size_t>(first[b]) + 3 * middle[b];
    Eigen::Matrix3d block;
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) block(i, k) = entries[3 * k * blocks + i];
    block.diagonal().array() += shift;
    const Eigen::LLT<Eigen::Matrix3d> factor(block);
    if (factor.info() != Eigen::Success) return false;
    inverse_diagonal[b] = factor.solve(Eigen::Matrix3d::Identity()).cast<float>();
  }
  return true;
}

/// Pᵀ (K + shift I) P.
void PMultigrid::State::restrict_matrix(const SparseMatrix& matrix, double shift) {
  double* coarse = corner_matrix.valuePtr();
  std::fill_n(coarse, corner_matrix.nonZeros(), 0.0);
  for (int b = 0; b < nodes; ++b) {
    const int blocks = first[b + 1] - first[b];
    for (int s = 0; s < blocks; ++s) {
      const double* fine = matrix.valuePtr() + 9 * static_cast<std::size_t>(first[b]) + 3 * s;
      const auto& to = target[first[b] + s];
      for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) {
          const double share = 0.25 * (fine[3 * k * blocks + i] + (s == middle[b] && i == k ? shift : 0.0));
          for (int t = 0; t < 4; ++t) coarse[to[t] + k * corner_pattern.stride(corners.parents[b][t / 2]) + i] += share;
        }
    }
  }
}

PMultigrid::PMultigrid(const SparseMatrix& pattern, const Indices& cells)
    : state_(std::make_unique<State>(pattern, cells)) {}

PMultigrid::~PMultigrid() = default;

double PMultigrid::solves_per_factor() const { return measured_solves_per_setup; }

bool PMultigrid::factorise(const SparseMatrix& matrix, double shift) {
  State& s = *state_;
  if (!s.invert_diagonal(matrix, shift)) return false;
  s.restrict_matrix(matrix, shift);
  if (!s.corner_factor.factorise(s.corner_matrix)) return false;
  const double* entries = matrix.valuePtr();
  for (std::size_t i = 0; i < s.value.size(); ++i) s.value[i] = static_cast<float>(entries[i]);
  if (shift != 0)
    for (int b = 0; b < s.nodes; ++b)
      for (int k = 0; k < 3; ++k)
        s.value[9 * static_cast<std::size_t>(s.first[b]) + 3 * s.middle[b] + k * 3 * (s.first[b + 1] - s.first[b]) +
                k] += static_cast<float>(shift);
  return true;
}

/// x += P (Pᵀ K P)⁻¹ Pᵀ r
void PMultigrid::State::correct_on_corners() const {
  corner_force.setZero();
  for (int b = 0; b < nodes; ++b)
    for (const int parent : corners.parents[b])
      for (int i = 0; i < 3; ++i) corner_force[3 * parent + i] += 0.5 * r[3 * static_cast<std::size_t>(b) + i];
  corner_factor.solve(corner_force, corner_step);
  for (int b = 0; b < nodes; ++b)
    for (const int parent : corners.parents[b])
      for (int i = 0; i < 3; ++i)
        x[3 * static_cast<std::size_t>(b) + i] += static_cast<float>(0.5 * corner_step[3 * parent + i]);
}

void PMultigrid::solve(const Eigen::VectorXd& right_hand_side, Eigen::VectorXd& solution) const {
  const State& s = *state_;
  solution.setZero(right_hand_side.size());
  const double size = right_hand_side.cwiseAbs().maxCoeff();  // single precision keeps few powers of ten
  if (!(size > 0)) return;
  Eigen::Map<Eigen::VectorXf>(s.f.data(), right_hand_side.size()) = (right_hand_side / size).cast<float>();
  for (int b = 0; b < s.nodes; ++b)
    s.at(s.x, b) = s.inverse_diagonal[b] * (s.at(s.f, b) - s.product(b, 0, s.middle[b]));
  // What the sweep left: (D + L) x = f, so f - K x = -U x.
  for (int b = 0; b < s.nodes; ++b) s.at(s.r, b) = -s.product(b, s.middle[b] + 1, s.first[b + 1] - s.first[b]);
  s.correct_on_corners();
  for (int b = s.nodes - 1; b >= 0; --b) {
    if (b > 1) s.fetch(b - 2);
    s.at(s.x, b) += s.inverse_diagonal[b] * (s.at(s.f, b) - s.product(b, 0, s.first[b + 1] - s.first[b]));
  }
  solution = size * Eigen::Map<const Eigen::VectorXf>(s.x.data(), right_hand_side.size()).cast<double>();
}

}  // namespace supine::simulation
