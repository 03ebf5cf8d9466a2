// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// What TetMesh promises: indices in range, finite points, positive volumes, faces that are the whole boundary and look
/// outward, regions and tissues in range, fractions that sum to 1 (within 1e-6), face_cell right.
/// @throws InputError  naming the first offender: number, value and place in mm
void check_mesh(const TetMesh& mesh);

}  // namespace supine::meshing
