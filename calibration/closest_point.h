// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace supine::calibration {

/// The part of a triangle on which a closest point lies.
enum class Feature { face, edge, vertex };

/// The point of a triangle closest to a query point.
struct TrianglePoint {
  Eigen::Vector3d weight;  ///< barycentric, >= 0, sum 1; exactly 0 at the corners that do not take part
  Feature feature;
  int corner;  ///< edge: its first corner (corner → corner + 1); vertex: the corner; face: 0
};

/// Closest point of the triangle (a, b, c), by the Voronoi regions of its corners and edges (Ericson, Real-Time
/// Collision Detection, 5.1.5). Weights below 1e-9 count as zero, so that a point on an edge up to rounding
/// is on the edge.
/// @pre  the triangle has an area
TrianglePoint closest_on_triangle(const Eigen::Vector3d& query, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c);

}  // namespace supine::calibration
