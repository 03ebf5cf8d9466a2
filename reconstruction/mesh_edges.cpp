// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/mesh_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <tuple>

namespace supine::reconstruction {

namespace {

struct HalfEdge {
  int low, high, triangle;
  bool ascending;
};

/// Ordered by lower point, higher point and triangle. Counted into place by their lower points, of which each has few.
std::vector<HalfEdge> half_edges_by_lower_point(const Triangles& triangles) {
  if (triangles.rows() == 0) return {};
  const int least = triangles.minCoeff();
  std::vector<std::size_t> first(static_cast<std::size_t>(triangles.maxCoeff() - least) + 2, 0);
  const auto visit = [&triangles](const auto& use) {
    for (Eigen::Index t = 0; t < triangles.rows(); ++t)
      for (int c = 0; c < 3; ++c) {
        const int a = triangles(t, c), b = triangles(t, (c + 1) % 3);
        use(HalfEdge{std::min(a, b), std::max(a, b), static_cast<int>(t), a < b});
      }
  };
  visit([&](const HalfEdge& edge) { ++first[edge.low - least + 1]; });
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  std::vector<HalfEdge> half(first.back());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  visit([&](const HalfEdge& edge) { half[next[edge.low - least]++] = edge; });
  for (std::size_t i = 0; i + 1 < first.size(); ++i)
    std::sort(half.begin() + first[i], half.begin() + first[i + 1], [](const HalfEdge& x, const HalfEdge& y) {
      return std::tie(x.high, x.triangle) < std::tie(y.high, y.triangle);
    });
  return half;
}

}  // namespace

std::vector<MeshEdge> mesh_edges(const Triangles& triangles) {
  const std::vector<HalfEdge> half = half_edges_by_lower_point(triangles);
  std::vector<MeshEdge> edges;
  edges.reserve(half.size() / 2);
  for (std::size_t i = 0; i < half.size();) {
    MeshEdge edge{{half[i].low, half[i].high}};
    std::size_t end = i;
    for (; end < half.size() && half[end].low == half[i].low && half[end].high == half[i].high; ++end) {
      if (edge.count < 2) edge.triangles[edge.count] = half[end].triangle;
      ++edge.count;
    }
    if (edge.count == 2) edge.opposite = half[i].ascending != half[i + 1].ascending;
    edges.push_back(edge);
    i = end;
  }
  return edges;
}

std::vector<std::vector<int>> point_neighbours(const std::vector<MeshEdge>& edges, Eigen::Index point_count) {
  std::vector<std::vector<int>> neighbours(point_count);
  for (const MeshEdge& edge : edges) {
    neighbours[edge.points[0]].push_back(edge.points[1]);
    neighbours[edge.points[1]].push_back(edge.points[0]);
  }
  for (auto& list : neighbours) std::sort(list.begin(), list.end());
  return neighbours;
}

Points point_normals(const Points& points, const Triangles& triangles) {
  Points normals = Points::Zero(points.rows(), 3);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Eigen::RowVector3d a = points.row(triangles(t, 0)), b = points.row(triangles(t, 1)),
                             c = points.row(triangles(t, 2));
    const Eigen::RowVector3d twice_area = (b - a).cross(c - a);
    for (int corner = 0; corner < 3; ++corner) normals.row(triangles(t, corner)) += twice_area;
  }
  for (Eigen::Index p = 0; p < normals.rows(); ++p) {
    const double length = normals.row(p).norm();
    if (length > 0) normals.row(p) /= length;
  }
  return normals;
}

}  // namespace supine::reconstruction
