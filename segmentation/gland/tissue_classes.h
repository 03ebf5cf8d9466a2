// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "segmentation/masks.h"

namespace supine::segmentation {

/// Parts the voxels of a mask into fat and gland.
///
/// Fat scatters about 0 contrast with a standard deviation of its own at every place. A voxel that holds gland may hold
/// any share of it, so its contrast is uniform up to that of pure gland, blurred by the same noise (the law of mixed
/// voxels of Santago and Gage, IEEE TMI 12, 1993). Neighbours are alike (Potts field), in the mean-field approximation
/// (Zhang, IEEE Trans. Signal Process. 40, 1992); the share of gland is fitted (expectation maximisation).
struct GlandClasses {
  double prior = 0.1;              ///< share of the voxels that hold gland, as fitted
  std::vector<float> probability;  ///< of gland, per voxel of the grid; 0 outside the mask
};

/// @param contrast  per voxel: 0 fat, `pure` gland
/// @param deviation  per voxel: of the fat's contrast, > 0
/// @param neighbourhood  strength of the Potts field; 0 = every voxel for itself. Scaled per axis by the finest voxel
///   side over the axis' own: far neighbours say less
GlandClasses classify_gland(const std::vector<float>& contrast, const std::vector<float>& deviation, const Mask& within,
                            const Grid& grid, double pure, double neighbourhood);

}  // namespace supine::segmentation
