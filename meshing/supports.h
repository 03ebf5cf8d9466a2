// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// Of each boundary face the support it lies on, as a row of TetMesh::support_names (0 where the muscle is the one
/// support): that of the nearest triangle of the sheet. −1 for faces that lie on none (skin, cut). #F.
Eigen::VectorXi support_of_faces(const TetMesh& mesh);

/// Centroid, area and second moments of the imaged faces of one support.
struct SupportArea {
  Eigen::Vector3d centroid_mm = Eigen::Vector3d::Zero();
  double area_mm2 = 0;
  double bending_mm4 = 0;                            ///< ∫ y² dA, mean of the two directions in the support's plane
  double polar_mm4 = 0;                              ///< ∫ y² + z² dA about the mean normal
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit; mean, out of the body
};

/// @param support  row of TetMesh::support_names
/// @return area 0 where no face lies on it
SupportArea support_area(const TetMesh& mesh, const Eigen::VectorXi& support_of_face, int support);

/// The sheet of one support; the whole of it where the muscle is the one support.
reconstruction::Surface sheet_of(const TetMesh& mesh, int support);

}  // namespace supine::meshing
