// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "calibration/surface_distance.h"

namespace supine::calibration {

/// Faces of quadratic cells as a surface of small flat triangles, for distances to the curved skin: each is cut into
/// sixteen, which leave a sixteenth of the sagitta that a flat face has (of 12 mm on a radius of 50 mm: 0.02 mm).
class CurvedFaces {
 public:
  /// @param faces  #F by 6: three corners, then the middles of the edges 01, 12 and 20; rows of the mesh's points
  explicit CurvedFaces(const Indices& faces);

  /// Places of the corners of the triangles where the mesh's points are at @p points.
  Points corners(const Points& points) const { return weights_ * points.topRows(weights_.cols()); }
  const Triangles& triangles() const { return triangles_; }

  /// Closest points on triangles() by the nodes of their face, six to a row: node and weight (which may be negative),
  /// with point = Σ weight · node as before. triangle becomes the row of the quarter of the face, four to a face: at
  /// its corners, and in its middle.
  void by_faces(ClosestPoints& closest) const;

 private:
  Indices faces_;
  Triangles triangles_;                                   // in order of the faces
  Eigen::SparseMatrix<double, Eigen::RowMajor> weights_;  // #corners by mesh points
};

}  // namespace supine::calibration
