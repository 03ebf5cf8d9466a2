// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/arrays.h"

namespace supine::calibration {

/// Who is whose neighbour on a triangle surface, and where the surface ends.
///
/// Points with the very same coordinates count as one vertex, so that a soup of triangles (STL) is a surface.
/// An edge that belongs to one triangle only is a border: of the outside or of a hole.
class SurfaceTopology {
 public:
  SurfaceTopology() = default;
  /// @pre  every index in @p triangles is a row of @p points
  SurfaceTopology(const Points& points, const Triangles& triangles);

  /// Rows of the triangles around edge corner → corner + 1 of @p triangle, ascending; none where a triangle has a
  /// corner twice.
  std::span<const int> around_edge(int triangle, int corner) const;
  /// Rows of the triangles around corner @p corner of @p triangle, ascending.
  std::span<const int> around_vertex(int triangle, int corner) const;
  bool border_edge(int triangle, int corner) const { return around_edge(triangle, corner).size() == 1; }
  bool border_vertex(int triangle, int corner) const { return border_vertex_[vertex_(triangle, corner)]; }

  /// Vertex numbers of the triangles' corners, #T by 3: the lowest row of the points that share the place.
  const Triangles& vertex() const { return vertex_; }
  /// Vertex of each point, #P.
  const std::vector<int>& vertex_of_point() const { return vertex_of_point_; }

 private:
  void build_edges();
  void build_stars(Eigen::Index point_count);

  Triangles vertex_;
  std::vector<int> vertex_of_point_;
  std::vector<std::array<int, 3>> edge_;  // per triangle, edge number of corner → corner + 1; -1: a corner twice
  std::vector<int> edge_begin_, edge_triangles_;
  std::vector<int> star_begin_, star_triangles_;
  std::vector<bool> border_vertex_;
};

/// Turns triangles over until neighbours agree on which side is up, each connected piece on its own.
/// Across an edge of more than two triangles nothing is decided.
/// @return piece of each triangle, #T, numbered from 0
std::vector<int> orient_pieces(const SurfaceTopology& topology, Triangles& triangles);

}  // namespace supine::calibration
