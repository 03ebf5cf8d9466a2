// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/mesh_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <tuple>

namespace supine::reconstruction {

std::vector<MeshEdge> mesh_edges(const Triangles& triangles) {
  struct HalfEdge {
    int low, high, triangle;
    bool ascending;
  };
  std::vector<HalfEdge> half(3 * triangles.rows());
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      const int a = triangles(t, c), b = triangles(t, (c + 1) % 3);
      half[3 * t + c] = {std::min(a, b), std::max(a, b), static_cast<int>(t), a < b};
    }
  std::sort(half.begin(), half.end(), [](const HalfEdge& x, const HalfEdge& y) {
    return std::tie(x.low, x.high, x.triangle) < std::tie(y.low, y.high, y.triangle);
  });
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
