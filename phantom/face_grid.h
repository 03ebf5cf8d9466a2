// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/arrays.h"
#include "meshing/tet_mesh.h"

namespace supine::phantom {

/// Boundary faces of a mesh cut into n² triangles each, corners shared between neighbours, curved faces as they are.
class FaceGrid {
 public:
  /// @param faces  rows of mesh.faces   @param steps  n >= 1
  FaceGrid(const meshing::TetMesh& mesh, std::vector<int> faces, int steps);

  const Triangles& triangles() const { return triangles_; }
  const Eigen::VectorXi& region() const { return region_; }  ///< by triangle
  Eigen::Index points() const { return static_cast<Eigen::Index>(spots_.size()); }

  /// Where the grid's points are when the nodes are at @p nodes.
  Points at(const Points& nodes) const;

 private:
  struct Spot {
    int face;
    double b, c;  // barycentric, of corners 1 and 2
  };
  const meshing::TetMesh& mesh_;
  std::vector<Spot> spots_;
  Triangles triangles_;
  Eigen::VectorXi region_;
};

/// Unit normals at the points of a triangle surface, area-weighted.
Points point_normals(const Points& points, const Triangles& triangles);

/// Rows of mesh.faces with this region; any of them with region 0.
std::vector<int> faces_with(const meshing::TetMesh& mesh, int region);

}  // namespace supine::phantom
