// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/fairing.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/mesh_edges.h"

namespace supine::reconstruction {
namespace {

// Below this, waiting for the other threads costs more than they save.
constexpr Eigen::Index rows_worth_threads = 50000;

// Rows of a sparse matrix; applied row by row, so the sum's order never depends on the threads.
struct SparseRows {
  std::vector<std::size_t> begin{0};
  std::vector<int> column;
  std::vector<double> value;

  Points times(const Points& x) const {
    const auto rows = static_cast<Eigen::Index>(begin.size()) - 1;
    Points y(rows, 3);
#pragma omp parallel for schedule(static) if (rows > rows_worth_threads)
    for (Eigen::Index r = 0; r < rows; ++r) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (std::size_t e = begin[r]; e < begin[r + 1]; ++e) sum += value[e] * x.row(column[e]);
      y.row(r) = sum;
    }
    return y;
  }

  SparseRows transposed() const {
    const std::size_t rows = begin.size() - 1;
    SparseRows t;
    t.begin.assign(rows + 1, 0);
    for (const int c : column) ++t.begin[c + 1];
    for (std::size_t r = 0; r < rows; ++r) t.begin[r + 1] += t.begin[r];
    t.column.resize(column.size());
    t.value.resize(value.size());
    std::vector<std::size_t> next(t.begin.begin(), t.begin.end() - 1);
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t e = begin[r]; e < begin[r + 1]; ++e) {
        t.column[next[column[e]]] = static_cast<int>(r);
        t.value[next[column[e]]++] = value[e];
      }
    return t;
  }

  double largest_column_sum() const {
    std::vector<double> sum(begin.size() - 1, 0.0);
    for (std::size_t e = 0; e < column.size(); ++e) sum[column[e]] += std::abs(value[e]);
    return sum.empty() ? 0 : *std::max_element(sum.begin(), sum.end());
  }
};

// Points whose mean a point is drawn to: along the border for border points, all around for the others.
std::vector<std::vector<int>> stencils(const Surface& surface, const std::vector<MeshEdge>& edges) {
  std::vector<std::vector<int>> along(surface.points.rows());
  for (const MeshEdge& edge : edges) {
    const bool between = edge.count != 2 || (surface.region.size() > 0 &&
                                             surface.region(edge.triangles[0]) != surface.region(edge.triangles[1]));
    if (!between) continue;
    along[edge.points[0]].push_back(edge.points[1]);
    along[edge.points[1]].push_back(edge.points[0]);
  }
  std::vector<std::vector<int>> all = point_neighbours(edges, surface.points.rows());
  for (std::size_t p = 0; p < all.size(); ++p) {
    if (along[p].empty()) continue;
    if (along[p].size() == 2)
      all[p] = along[p];
    else
      all[p].clear();
  }
  return all;
}

// Weights 1/mm² over 1/steps²: equal for cubic voxels, and the same smoothness in every direction for flat ones.
SparseRows laplacian(const Surface& surface, const std::vector<std::vector<int>>& stencil,
                     const Eigen::Vector3d& spacing_mm) {
  SparseRows rows;
  for (std::size_t p = 0; p < stencil.size(); ++p) {
    double total = 0;
    std::vector<double> weight;
    for (const int n : stencil[p]) {
      const Eigen::RowVector3d step = surface.points.row(n) - surface.points.row(p);
      weight.push_back(step.cwiseQuotient(spacing_mm.transpose()).squaredNorm() / step.squaredNorm());
      total += weight.back();
    }
    if (!weight.empty()) {
      rows.column.push_back(static_cast<int>(p));
      rows.value.push_back(1);
    }
    for (std::size_t i = 0; i < weight.size(); ++i) {
      rows.column.push_back(stencil[p][i]);
      rows.value.push_back(-weight[i] / total);
    }
    rows.begin.push_back(rows.column.size());
  }
  return rows;
}

double mean_edge_mm(const Surface& surface, const std::vector<MeshEdge>& edges) {
  double sum = 0;
  for (const MeshEdge& edge : edges)
    sum += (surface.points.row(edge.points[0]) - surface.points.row(edge.points[1])).norm();
  return sum / static_cast<double>(edges.size());
}

// The smooth part of a displacement: each pass takes the mean over a point and its neighbours.
Points averaged(Points displacement, const std::vector<std::vector<int>>& neighbours, int passes) {
  const Eigen::Index count = displacement.rows();
  Points next(count, 3);
  for (int pass = 0; pass < passes; ++pass) {
#pragma omp parallel for schedule(static) if (count > rows_worth_threads)
    for (Eigen::Index p = 0; p < count; ++p) {
      Eigen::RowVector3d sum = displacement.row(p);
      for (const int n : neighbours[p]) sum += displacement.row(n);
      next.row(p) = sum / static_cast<double>(neighbours[p].size() + 1);
    }
    displacement.swap(next);
  }
  return displacement;
}

}  // namespace

Points fair(const Surface& surface, const FairingOptions& options) {
  if (options.length_mm <= 0 || surface.triangles.rows() == 0) return surface.points;
  const std::vector<MeshEdge> edges = mesh_edges(surface.triangles);
  const SparseRows bend = laplacian(surface, stencils(surface, edges), options.spacing_mm);
  const SparseRows bend_transposed = bend.transposed();
  const double weight = 16 * std::pow(options.length_mm / mean_edge_mm(surface, edges), 4);
  const double steepest = 1 + weight * 2 * bend.largest_column_sum();
  const Eigen::RowVector3d half = 0.5 * options.spacing_mm.transpose();
  const Points low = surface.points.rowwise() - half, high = surface.points.rowwise() + half;

  Points x = surface.points, y = x;
  double momentum = 1;
  for (int i = 0; i < options.iterations; ++i) {
    const Points gradient = (y - y.cwiseMax(low).cwiseMin(high)) + weight * bend_transposed.times(bend.times(y));
    const Points next = y - gradient / steepest;
    if (gradient.cwiseProduct(next - x).sum() > 0) momentum = 1;
    const double next_momentum = 0.5 * (1 + std::sqrt(1 + 4 * momentum * momentum));
    y = next + (momentum - 1) / next_momentum * (next - x);
    x = next;
    momentum = next_momentum;
  }
  return x - averaged(x - surface.points, point_neighbours(edges, surface.points.rows()), options.give_back);
}

}  // namespace supine::reconstruction
