// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// Moves inner points of badly shaped tetrahedra (smallest dihedral angle under @p wanted_deg) to where the worst
/// tetrahedron around each is best. Boundary points stay; no tetrahedron gets worse than the worst of its star was.
/// @pre  mesh.order() == 1
void improve_cells(TetMesh& mesh, double wanted_deg = 20);

}  // namespace supine::meshing
