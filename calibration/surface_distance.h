// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>

#include "common/arrays.h"

namespace supine::calibration {

/// Closest points of a batch of queries, one row per query. Reused buffers keep their memory.
struct ClosestPoints {
  Points point;                 ///< #Q by 3, mm
  Eigen::VectorXd distance_mm;  ///< #Q, >= 0
  Eigen::VectorXi triangle;     ///< #Q; -1 on a bare point cloud
  Indices node;                 ///< #Q by 3; points of the triangle; of a cloud: the nearest point, thrice
  Table weight;                 ///< #Q by 3; barycentric, point = Σ weight · node; of a cloud (1, 0, 0)
  Points normal;                ///< #Q by 3; unit pseudo-normal; of a cloud: of the local fit, its sense open
  Eigen::Array<bool, Eigen::Dynamic, 1> on_border;  ///< #Q; on an open edge; of a cloud: beyond its last points

  void resize(Eigen::Index queries);
};

/// Index for closest points on a triangle surface or a bare point cloud: the one place where distances are computed.
///
/// Triangles: exact closest point (CGAL AABB tree). The pseudo-normal is that of the face, the mean of the faces
/// around the edge, or the angle-weighted mean around the vertex on which the closest point lies; with it the sign of
/// a distance is right everywhere (Baerentzen and Aanaes 2005). Where several triangles share the closest point, the
/// one with the lowest row is named. Triangles without area are skipped.
///
/// Bare points: closest point of the sphere fitted to the 18 neighbours of the nearest point (see PointCloud).
class SurfaceDistance {
 public:
  /// @param triangles  none makes it a point cloud
  /// @throws InputError  a triangle names a point that is not there; coordinates not finite; no triangle has an area;
  ///   a cloud of fewer than 19 points
  SurfaceDistance(const Points& points, const Triangles& triangles);
  ~SurfaceDistance();
  SurfaceDistance(SurfaceDistance&&) noexcept;
  SurfaceDistance& operator=(SurfaceDistance&&) noexcept;

  /// Same triangles, new places of the points.
  void move(const Points& points);

  /// Closest points of @p queries (#Q by 3). Runs on the OpenMP threads; the result does not depend on their number.
  void closest(const Points& queries, ClosestPoints& result) const;

  bool is_cloud() const;
  /// Bare points in rows along lines (PointCloud): they say where a surface passes and cover none of it.
  bool is_contour() const;
  const Points& points() const;
  const Triangles& triangles() const;
  /// #P by 3, unit; angle-weighted mean of the faces around each point, zero where a point has none; of a cloud the
  /// normals of the local fits, of a contour zero.
  const Points& normals() const;
  /// Areas of the triangles, #T, mm²; empty for a cloud.
  const Eigen::VectorXd& areas_mm2() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace supine::calibration
