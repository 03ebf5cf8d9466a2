// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "meshing/body_surface.h"
#include "meshing/tet_mesh.h"
#include "segmentation/support_voxels.h"

namespace supine::meshing {

/// Fills part_names and part_fraction: the share of each cell's volume in each part, exact for planes, of 84 points of
/// the cell for surfaces. A part that is no label carries no tissue: a mesh without tissues is made one of adipose.
/// @throws InputError  parts that overlap (names both, volume and place); a part that no cell lies in
void assign_parts(TetMesh& mesh, const std::vector<BodyPlace>& parts);

/// Fills support_names and muscle_support from the case's supports.
/// @pre  mesh.muscle is the sheet of with_support_regions()
void assign_supports(TetMesh& mesh, const std::vector<BodyPlace>& supports);

/// The same from the supports of a label map: that of the voxel nearest to each triangle's centre.
/// @pre  a voxel belongs to a support
void assign_supports(TetMesh& mesh, const segmentation::SupportVoxels& supports, const segmentation::Grid& grid);

}  // namespace supine::meshing
