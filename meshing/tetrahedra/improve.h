// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// In both, walls are triangles of interfaces inside (by points of @p mesh): they and their points stay.

/// Moves inner points of badly shaped tetrahedra (shape_angle_deg under @p wanted_deg) to where the worst
/// tetrahedron around each is best. Boundary points stay; no tetrahedron gets worse than the worst of its star was.
/// @pre  mesh.order() == 1
void move_points(TetMesh& mesh, double wanted_deg = 20, const Triangles& walls = {});

/// Replaces each tetrahedron of shape_angle_deg under @p wanted_deg, with its neighbours, by the tetrahedra from a new
/// point to the boundary of that cavity, where this makes the worst of them better. It helps where all four corners of
/// a flat tetrahedron lie on the boundary, which move_points() cannot. Faces and regions stay; face_cell is filled in
/// again.
/// @pre  mesh.order() == 1, tissue and fraction not filled in
/// @return points added
int insert_points(TetMesh& mesh, double wanted_deg = 16, const Triangles& walls = {});

}  // namespace supine::meshing
