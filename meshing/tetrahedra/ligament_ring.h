// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// Half the width of the ligament ring at its default place, the mound's foot.
inline constexpr double ligament_half_width_mm = 6;

/// Gives region ligament to the inner faces whose centroid is within @p half_width_mm of the foot, and inner to the
/// ligament faces that are not. @return faces of the ring
Eigen::Index mark_ligament_ring(TetMesh& mesh, const Anatomy& anatomy, double half_width_mm = ligament_half_width_mm);

}  // namespace supine::meshing
