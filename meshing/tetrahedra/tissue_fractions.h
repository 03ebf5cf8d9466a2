// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "meshing/tet_mesh.h"
#include "segmentation/image.h"

namespace supine::meshing {

/// How the mesh and the labels fit.
struct FractionReport {
  /// By segmentation::Tissue; meshed tissues only, the others 0; fat and gland by the share of gland where one is
  /// given.
  Eigen::VectorXd voxel_ml;
  double outside_share = 0;  ///< of the mesh's volume: further than the search radius from any meshed tissue
};

/// Barycentric coordinates of 84 evenly spread points of a tetrahedron, all of the same weight.
const std::vector<Eigen::RowVector4d>& cell_samples();

/// Fills mesh.fraction and mesh.tissue: the label of the voxel around each of 84 evenly spread points of every
/// tetrahedron. Points on air, muscle or excluded voxels (the surface runs through the voxels' staircase) count for the
/// nearest meshed tissue within 3 voxels, or else not at all; a tetrahedron without any such point takes the meshed
/// voxel nearest to its centre within 10 voxels, or else is adipose.
/// @param gland_share  of each voxel of the labels, 0 to 1: where given, voxels of fat and gland count as so much
/// gland, the
///   rest as fat, whichever their label; empty = by label
/// @throws InputError  more than 5 % of the mesh's volume is nowhere near meshed tissue: the labels are another case's,
/// or in
///   another frame; what is meshed of them around the mesh is more than 1.25 times as much as the mesh holds, or less,
///   or its middle lies more than 5 mm elsewhere
FractionReport assign_tissue(TetMesh& mesh, const segmentation::LabelImage& labels,
                             std::span<const float> gland_share = {});

}  // namespace supine::meshing
