// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "common/arrays.h"

namespace supine::meshing {

/// Closest points on triangles, with the triangle and its weights: what fitting a surface needs. Boxes in a binary
/// tree.
class TriangleTree {
 public:
  struct Hit {
    int triangle = -1;                                ///< row of the triangles given; −1 when nothing is near enough
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< the closest point
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();  ///< of the triangle's corners, sum 1, each in [0, 1]
    double squared_mm2 = std::numeric_limits<double>::infinity();
  };

  /// Copies what it needs. @pre  at least one triangle
  TriangleTree(const Points& points, const Triangles& triangles);

  /// @param within_mm  what lies further away is not found
  Hit closest(const Eigen::Vector3d& at, double within_mm = std::numeric_limits<double>::infinity()) const;

  /// One hit per row, on all threads; the result does not depend on their number.
  /// @param near  by row a triangle that is likely near, −1 where none is known: searches start from its distance.
  ///   Empty: rows are taken to follow each other in space
  /// @pre  near is empty or has a row of the triangles, or −1, for each point
  std::vector<Hit> closest(const Points& at, const std::vector<int>& near = {}) const;

  /// Distances alone, mm.
  Eigen::VectorXd distances_mm(const Points& at) const;

  /// Rows of all triangles whose boxes overlap the box given, ascending.
  std::vector<int> overlapping(const Eigen::AlignedBox3d& box) const;

  /// All pairs of triangles whose boxes touch and that @p keep picks, ascending; on all threads.
  std::vector<std::pair<int, int>> pairs(const std::function<bool(int, int)>& keep) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first, count;  // triangles of a leaf (count > 0), or the two children at first and first + 1
  };
  void split(int node, int first, int last, const Points& centres, const std::vector<Eigen::AlignedBox3d>& boxes);
  void improve(int place, const Eigen::Vector3d& at, Hit& best) const;
  static double rounded_up(const Hit& best);
  Hit search(const Eigen::Vector3d& at, Hit best) const;
  Hit search_from(const Eigen::Vector3d& at, int triangle) const;
  Eigen::AlignedBox3d box_of(int place) const;
  void pairs_of_leaf(const Node& leaf, const std::function<bool(int, int)>& keep,
                     std::vector<std::pair<int, int>>& found) const;

  std::vector<Node> nodes_;
  std::vector<int> order_;                               // triangles as the leaves hold them
  std::vector<int> place_;                               // of each triangle in that order
  std::vector<std::array<Eigen::Vector3d, 3>> corners_;  // in that order
};

/// Closest point of triangle abc to p (Ericson, Real-Time Collision Detection, 5.1.5). @return weights of a, b, c
Eigen::Vector3d closest_weights(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& abc);

}  // namespace supine::meshing
