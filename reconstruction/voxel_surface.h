// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <numeric>
#include <vector>

#include "reconstruction/surface.h"
#include "segmentation/image.h"
#include "segmentation/tissue.h"

namespace supine::reconstruction {

/// A set of tissues; index = value of segmentation::Tissue.
using TissueSet = std::array<bool, segmentation::tissue_count>;

/// All tissues that tetrahedra are made of.
TissueSet meshed_tissues();
TissueSet only(segmentation::Tissue tissue);

using VoxelIndices = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// The staircase surface of a set of voxels: every point lies half-way between a voxel inside and one outside.
struct VoxelSurface {
  /// Closed, without regions. Points are voxel index times spacing (mm along the image axes, seen from voxel 0);
  /// to_patient() takes them to LPS. Outward when the axes are right-handed.
  Surface surface;
  VoxelIndices inside;    ///< #P by 3, the voxel of the set at each point
  VoxelIndices outside;   ///< #P by 3, the voxel beyond it; −1 or size where the set touches the edge of the image
  Eigen::VectorXi piece;  ///< #P, the piece of the set the point lies on; pieces are voxels joined through faces
  std::vector<double> piece_volume_mm3;  ///< voxels of each piece; a piece's volume leaves out its cavities
  int dropped_pieces = 0;                ///< pieces left out for their size
  double dropped_volume_mm3 = 0;

  double voxel_volume_mm3() const { return std::accumulate(piece_volume_mm3.begin(), piece_volume_mm3.end(), 0.0); }
};

/// Marching cubes around the voxels whose tissue is in @p members; empty when there are none.
/// The image counts as surrounded by voxels that are not in the set.
/// @param smallest_piece_mm3  smaller pieces are left out; the largest piece stays in any case
VoxelSurface voxel_surface(const segmentation::LabelImage& image, const TissueSet& members,
                           double smallest_piece_mm3 = 0);

/// Takes points from image axes (VoxelSurface) to patient LPS and turns the triangles round for left-handed axes.
Surface to_patient(Surface surface, const segmentation::Grid& grid);

}  // namespace supine::reconstruction
