// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/curved_faces.h"
#include "calibration/surface_distance.h"
#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"

namespace supine::calibration {

/// Named areas of the skin, each skin point in one of them.
struct SkinAreas {
  std::vector<std::string> names;  ///< in the order of tables; empty: no areas
  Eigen::VectorXi of_point;        ///< #N; index into names; -1 off the skin
};

/// The skin of the model in one pose: the part of its boundary that a scanner sees.
///
/// Distances are those to the curved faces of quadratic cells (CurvedFaces). Areas, pictures and normals of nodes take
/// such a face as four flat triangles over its six nodes.
class ModelSkin {
 public:
  /// @param positions  #N by 3, places of the mesh points in the pose, mm
  /// @throws InputError  no skin faces, positions of another size or not finite
  ModelSkin(const meshing::TetMesh& mesh, const Points& positions);

  /// @param points     #N by 3, mm
  /// @param triangles  the skin, outward; rows of @p points
  ModelSkin(const Points& points, const Triangles& triangles);

  /// Another pose or another parameter: new places of the same mesh points.
  void move(const Points& positions);

  /// Closest points of @p queries (#Q by 3, mm) on the skin. node and weight hold the nodes of the face, three or six
  /// to a row, of six some with negative weights; triangle is a row of triangles().
  void closest(const Points& queries, ClosestPoints& result) const;

  /// The flat triangles; rows are those of the mesh's points.
  const SurfaceDistance& distance() const { return distance_; }
  const Triangles& triangles() const { return distance_.triangles(); }
  /// Mesh points of the skin, ascending.
  const std::vector<int>& nodes() const { return nodes_; }
  /// Places and outward normals of nodes(), #nodes by 3.
  Points node_points() const;
  Points node_normals() const;

 private:
  SurfaceDistance distance_;
  std::optional<CurvedFaces> curved_;         // of quadratic cells, and
  std::optional<SurfaceDistance> of_curved_;  // their index
  std::vector<int> nodes_;
};

/// Areas as Anatomy::area_name_of() gives them, from the imaged shape.
SkinAreas anatomical_areas(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy);

}  // namespace supine::calibration
