// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "calibration/neighbour_search.h"

namespace supine::calibration {

/// Nearest points of a bare point cloud, and the sphere or plane that the surface resembles around each of them.
///
/// Around each point a paraboloid of revolution h = c0 + c1 u + c2 v + k/2 (u² + v²) is fitted to its 18 neighbours
/// over their plane (least squares); distances are those to the osculating sphere. This averages the noise of single
/// points, and unlike the plane alone it is not drawn inward where the surface is curved.
///
/// Where most neighbours lie along lines the points are a contour: rows that say where a surface passes and nothing of
/// the surface between them. Then each point stands for itself, without a normal, and everything is past its border.
class PointCloud {
 public:
  /// Further than this many local spacings from the nearest point, along the surface, there is none: a hole.
  static constexpr double reach_spacings = 2;

  static constexpr int neighbours = 18;  ///< about two and a half spacings around

  /// @pre  more points than neighbours
  explicit PointCloud(const Points& points);

  /// What lies closest to a query point.
  struct Hit {
    int point;  ///< nearest point
    Eigen::Vector3d
        closest;  ///< on the local sphere; of a contour, or further off than reach_spacings, the nearest point itself
    bool beyond_border;  ///< past the last points: a contour, further off than reach_spacings, or all on one side
  };
  Hit closest(const Eigen::Vector3d& query) const;

  /// #P by 3, unit normals of the local fits; which way they point is not determined. Zero of a contour.
  const Points& normals() const { return normal_; }
  bool is_contour() const { return contour_; }
  /// #P; mean distance to the six nearest neighbours, mm.
  const Eigen::VectorXd& spacing_mm() const { return spacing_mm_; }

 private:
  // Whether the neighbours of a point of the surface lie within a half-plane around it.
  bool one_sided(const Eigen::Vector3d& foot, const Eigen::Vector3d& normal) const;

  NeighbourSearch tree_;
  Points foot_;  // where the fit crosses the normal through the neighbours' centre
  Points normal_;
  Eigen::VectorXd curvature_;  // 1/mm; > 0: hollow on the normal's side
  Eigen::VectorXd spacing_mm_;
  bool contour_ = false;
};

}  // namespace supine::calibration
