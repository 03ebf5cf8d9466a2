// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/quads/cross_field.h"

#include <Eigen/Geometry>
#include <cmath>

namespace supine::meshing {
namespace {

constexpr double wish_weight = 0.6;  // of a sure wish, in the sum of a point's neighbours

Eigen::Vector3d row(const Points& points, int p) { return points.row(p).transpose(); }

Eigen::Vector3d tangent(const Eigen::Vector3d& v, const Eigen::Vector3d& n) {
  const Eigen::Vector3d flat = v - v.dot(n) * n;
  const double length = flat.norm();
  return length > 1e-9 ? Eigen::Vector3d(flat / length) : n.unitOrthogonal();
}

Eigen::Vector3d smoothed(const FieldGraph& graph, const Points& q, int p) {
  const Eigen::Vector3d n = row(graph.normals, p);
  if (graph.line.row(p).squaredNorm() > 0) return row(graph.line, p);
  Eigen::Vector3d sum = row(q, p);
  double weight = 0;
  for (int i = graph.start[p]; i < graph.start[p + 1]; ++i) {
    const int other = graph.neighbour[i];
    const auto [a, b] = matching_turns(sum, n, row(q, other), row(graph.normals, other));
    sum = a * weight + b * graph.weight[i];
    weight += graph.weight[i];
    sum = tangent(sum, n);
  }
  const Eigen::Vector3d wish = row(graph.wish, p);
  const double sure = wish.norm();
  if (sure > 0) {
    const auto [a, b] = matching_turns(sum, n, Eigen::Vector3d(wish / sure), n);
    sum = tangent(a + wish_weight * sure * b, n);
  }
  return sum;
}

void sweep(const FieldGraph& graph, Points& q) {
  for (const std::vector<int>& colour : graph.colours) {
    const auto count = static_cast<std::ptrdiff_t>(colour.size());
#pragma omp parallel for schedule(static) if (count > 2000)
    for (std::ptrdiff_t i = 0; i < count; ++i) q.row(colour[i]) = smoothed(graph, q, colour[i]).transpose();
  }
}

}  // namespace

std::pair<Eigen::Vector3d, Eigen::Vector3d> matching_turns(const Eigen::Vector3d& q_a, const Eigen::Vector3d& n_a,
                                                           const Eigen::Vector3d& q_b, const Eigen::Vector3d& n_b) {
  const Eigen::Vector3d a[2] = {q_a, n_a.cross(q_a)}, b[2] = {q_b, n_b.cross(q_b)};
  int best_a = 0, best_b = 0;
  double best = -1;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      // A hair's preference for the first of equals keeps rounding from deciding.
      if (const double score = std::abs(a[i].dot(b[j])); score > best + 1e-12) {
        best = score;
        best_a = i;
        best_b = j;
      }
  const double sign = a[best_a].dot(b[best_b]) < 0 ? -1 : 1;
  return {a[best_a], sign * b[best_b]};
}

CrossField cross_field(const std::vector<FieldGraph>& levels, int sweeps) {
  CrossField field(levels.size());
  for (std::size_t l = levels.size(); l-- > 0;) {
    const FieldGraph& graph = levels[l];
    field[l].resize(graph.size(), 3);
    for (int p = 0; p < graph.size(); ++p) {
      const Eigen::Vector3d n = row(graph.normals, p);
      // Toward a neighbour, not along an axis: a turned input gives the turned result.
      Eigen::Vector3d start = n.unitOrthogonal();
      if (graph.start[p] < graph.start[p + 1])
        start = row(graph.points, graph.neighbour[graph.start[p]]) - row(graph.points, p);
      if (l + 1 < levels.size()) start = row(field[l + 1], graph.parent[p]);
      if (graph.line.row(p).squaredNorm() > 0) start = row(graph.line, p);
      field[l].row(p) = tangent(start, n).transpose();
    }
    for (int s = 0; s < sweeps; ++s) sweep(graph, field[l]);
  }
  // Coarse levels take over what the finest found, for the position field.
  for (std::size_t l = 0; l + 1 < levels.size(); ++l)
    for (int p = 0; p < levels[l].size(); ++p) {
      const int parent = levels[l].parent[p];
      field[l + 1].row(parent) = tangent(row(field[l], p), row(levels[l + 1].normals, parent)).transpose();
    }
  return field;
}

}  // namespace supine::meshing
