// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"

namespace supine::diagnosis {

/// The same body cut into other, partly finer tetrahedra: what a prediction changes from one mesh to the other is a
/// measure of what the mesh costs.
///
/// The skin's end on the cut face is refined (meshing::refine_skin_edge), where most of the error of linear tetrahedra
/// comes from (docs/verification.md); the inside is filled anew, tissue fractions are means over each new cell of those
/// of @p mesh. Of the same order as @p mesh; quadratic ones are bent onto its boundary.
/// @param skin_edge_share  edge at the skin's end over what it is in @p mesh (the mean edge at the most), in (0, 1)
/// @throws InputError  when the boundary of @p mesh cannot be filled anew
meshing::TetMesh other_mesh(const meshing::TetMesh& mesh, double skin_edge_share);

/// The same body on another, coarser surface.
/// @param triangle_share  triangles aimed at over those of @p mesh, in (0, 1)
/// @throws InputError  as other_mesh
meshing::TetMesh coarser_mesh(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, double triangle_share);

}  // namespace supine::diagnosis
