// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <vector>

#include "common/arrays.h"

namespace supine::meshing {

/// Closest points on triangles, with the triangle and its weights: what fitting a surface needs. Boxes in a binary
/// tree.
class TriangleTree {
 public:
  struct Hit {
    int triangle = -1;        ///< row of the triangles given; −1 when nothing is near enough
    Eigen::Vector3d point;    ///< the closest point
    Eigen::Vector3d weights;  ///< of the triangle's corners, sum 1, each in [0, 1]
    double squared_mm2 = std::numeric_limits<double>::infinity();
  };

  /// Copies what it needs. @pre  at least one triangle
  TriangleTree(const Points& points, const Triangles& triangles);

  /// @param within_mm  what lies further away is not found
  Hit closest(const Eigen::Vector3d& at, double within_mm = std::numeric_limits<double>::infinity()) const;

  /// One hit per row, on all threads; the result does not depend on their number.
  std::vector<Hit> closest(const Points& at) const;

  /// Distances alone, mm.
  Eigen::VectorXd distances_mm(const Points& at) const;

  /// Rows of all triangles whose boxes overlap the box given, ascending.
  std::vector<int> overlapping(const Eigen::AlignedBox3d& box) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first, count;  // triangles of a leaf (count > 0), or the two children at first and first + 1
  };
  void split(int node, int first, int last, const Points& centres, const std::vector<Eigen::AlignedBox3d>& boxes);

  std::vector<Node> nodes_;
  std::vector<int> order_;                               // triangles as the leaves hold them
  std::vector<std::array<Eigen::Vector3d, 3>> corners_;  // in that order
};

/// Closest point of triangle abc to p (Ericson, Real-Time Collision Detection, 5.1.5). @return weights of a, b, c
Eigen::Vector3d closest_weights(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& abc);

}  // namespace supine::meshing
