// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "meshing/quads/field_mesh.h"

namespace supine::meshing {

/// One level of the hierarchy: points that know their neighbours, from the field mesh (level 0) to a handful.
struct FieldGraph {
  Points points, normals;
  Eigen::VectorXd area_mm2, size_mm;
  std::vector<int> start;      ///< neighbours of p are neighbour[start[p]] to neighbour[start[p + 1] − 1]
  std::vector<int> neighbour;  ///< ascending for each point
  std::vector<double> weight;
  std::vector<std::vector<int>> colours;  ///< points without common edges: updated together, in any order
  std::vector<int> parent;                ///< row in the next coarser level; empty on the coarsest

  Points line;               ///< unit tangent of the border a point lies on (or stands for); zero elsewhere
  Points on_line;            ///< a point of that border
  std::vector<char> corner;  ///< 1 where a border ends or turns sharply: that point, on_line, must be a node
  Points wish;               ///< tangent direction asked for by the curvature, as long as it is sure; zero elsewhere

  int size() const { return static_cast<int>(points.rows()); }
};

/// Levels from fine to coarse; each point of a level stands for one or two of the level before (Jakob et al. 2015,
/// section 3.4). Pairs are chosen by how well normals agree and in a fixed order.
std::vector<FieldGraph> field_hierarchy(const FieldMesh& mesh);

}  // namespace supine::meshing
