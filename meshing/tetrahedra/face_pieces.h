// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/tet_mesh.h"
#include "reconstruction/surface.h"

namespace supine::meshing {

/// The boundary of a quadratic mesh, every face in 16 flat triangles with their corners on the face, bent as it is:
/// what another mesh of the same body can be bent onto (curve_boundary).
/// @return closed where the boundary is, with the faces' regions; mm, LPS
/// @throws InputError  mesh is linear
reconstruction::Surface face_pieces(const TetMesh& mesh);

}  // namespace supine::meshing
