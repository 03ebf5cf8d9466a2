// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "common/arrays.h"

namespace supine::reconstruction {

/// An undirected edge with the triangles on it.
struct MeshEdge {
  std::array<int, 2> points;                ///< ascending
  std::array<int, 2> triangles = {-1, -1};  ///< the first two, ascending; −1 where there is none
  int count = 0;         ///< triangles on it: one on a border, two inside, more where it is not a manifold
  bool opposite = true;  ///< two triangles walk it in opposite directions, as a consistent orientation demands
};

/// All edges, ordered by their points.
std::vector<MeshEdge> mesh_edges(const Triangles& triangles);

/// Points next to each point along edges, ascending. @param point_count  rows of the point array
std::vector<std::vector<int>> point_neighbours(const std::vector<MeshEdge>& edges, Eigen::Index point_count);

/// Area-weighted unit normals, #P by 3 (zero where no triangle is).
Points point_normals(const Points& points, const Triangles& triangles);

}  // namespace supine::reconstruction
