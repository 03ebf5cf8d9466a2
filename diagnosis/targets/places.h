// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "calibration/model_skin.h"
#include "meshing/tet_mesh.h"

namespace supine::diagnosis {

/// The points asked for, then of each the skin that is nearest, then the skin over it against gravity (or the nearest
/// once more where none is).
struct Places {
  Points imaged, there;                                  ///< 3 #P by 3, mm: in the imaged pose and in the one asked for
  std::vector<Eigen::Vector3d> normal, straight_normal;  ///< #P, of the skin at these places, outward
  std::vector<bool> has_straight;                        ///< #P
};

/// @param imaged  #P by 3, mm, in the imaged pose
/// @param x       nodes of the mesh in the pose
/// @param up      unit, against gravity in the pose
Places places_of(const meshing::TetMesh& mesh, const Points& imaged, const Points& x, const Eigen::Vector3d& up);

}  // namespace supine::diagnosis
