// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "common/arrays.h"
#include "meshing/tet_mesh.h"

namespace supine::simulation {

/// Points that are carried along by the tissue: organ surfaces, landmarks.
class Embedding {
 public:
  /// Finds the cell of each of @p points (#P by 3, mm) in the imaged mesh; on quadratic cells the curved one, whose map
  /// is inverted by Newton's method. A point outside follows the closest place of the closest cell, continued from
  /// there along the cell's tangent map.
  Embedding(const meshing::TetMesh& mesh, const Points& points);

  /// Where the points are when the mesh's nodes are at @p positions (#N by 3). Same order as given.
  Points at(const Points& positions) const;

  /// Distance of each given point from the mesh, mm; 0 inside.
  const Eigen::VectorXd& outside_mm() const { return outside_mm_; }

 private:
  Indices nodes_;  // #P by nodes per cell
  Table weight_;   // #P by nodes per cell, rows sum to 1
  Eigen::VectorXd outside_mm_;
};

}  // namespace supine::simulation
