// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "reconstruction/voxel_surface.h"

namespace supine::reconstruction {

struct ShapingOptions {
  Eigen::Vector3d spacing_mm;  ///< of the voxels
  double length_mm = 3;        ///< of the fairing, see FairingOptions
};

struct ShapedSurface {
  Surface surface;  ///< as its VoxelSurface: along the image axes, same triangles and regions
  Eigen::Index less_smooth_points =
      0;  ///< held nearer to the staircase because the smooth surface crossed itself or turned over
};

/// Groups of surfaces that have points in common, directly or by way of others; each ascending, in the order of their
/// first. @param voxels  of one image
std::vector<std::vector<int>> touching_groups(const std::vector<const VoxelSurface*>& voxels);

/// Gives staircases their final shape: fairing, then the volume of the voxels piece by piece, then none that crosses
/// itself or is turned inside out. A point between a voxel of one surface and a voxel of another is one point of both
/// and stays so: they are faired as one surface, in which a common face counts once and is faired up to its rim, and
/// the rim as a curve. The volume is given back from the smallest surface to the largest; each moves the points that no
/// smaller one has. One surface alone may carry regions (VoxelSurface::surface.region), which fair() heeds.
/// @param voxels  of one image; at least one
/// @return in the order of @p voxels; the same for any number of threads
/// @throws NumericalFailure  a surface could not be repaired
std::vector<ShapedSurface> shape_together(const std::vector<const VoxelSurface*>& voxels,
                                          const ShapingOptions& options);

}  // namespace supine::reconstruction
