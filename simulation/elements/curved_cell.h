// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

#include "simulation/elements/elements.h"

namespace supine::simulation {

/// A place in a quadratic cell, and how far the point that was looked for lies from it.
struct CurvedPlace {
  Eigen::Vector4d b;          ///< barycentric, sum 1
  double outside_mm = 1e300;  ///< of the point from the cell; 0 inside
};

/// The map of one quadratic tetrahedron, turned round.
class CurvedCell {
 public:
  /// @param points  #N by 3, mm   @param cells  #C by 10, VTK node order   @param cell  a row of it
  CurvedCell(const Points& points, const Indices& cells, int cell) : nodes_(gather<10>(points, cells, cell)) {}

  /// Where the map takes @p b to @p point, by Newton's method from @p start; nothing where that is not in the cell.
  std::optional<Eigen::Vector4d> inside(const Eigen::Vector3d& point, const Eigen::Vector4d& start) const;

  /// The same; outside, the closest place of the cell.
  CurvedPlace find(const Eigen::Vector3d& point, const Eigen::Vector4d& start) const;

  /// No part of the cell is closer to @p point: the distance of the box around the control points of its Bézier form.
  double least_distance_mm(const Eigen::Vector3d& point) const;

  /// Shape functions at a place, continued from there along the cell's tangent map to @p point.
  Eigen::Matrix<double, 10, 1> weights(const Eigen::Vector3d& point, const Eigen::Vector4d& b) const;

 private:
  Eigen::Vector3d at(const Eigen::Vector4d& b) const { return nodes_.transpose() * tet10_shape(b); }
  Eigen::Matrix3d jacobian(const Eigen::Vector4d& b) const;
  CurvedPlace closest(const Eigen::Vector3d& point, const Eigen::Vector4d& start) const;

  NodeRows<10> nodes_;
};

}  // namespace supine::simulation
