// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "segmentation/masks.h"

namespace supine::segmentation {

/// The contrast without the noise of single voxels (Gaussian of 0.8 mm), 0 outside the mask; what lies outside does not
/// take part.
/// @param contrast  as of FatLevel, size grid.count() like the mask and what is returned
std::vector<float> smooth_contrast(const Mask& within, const std::vector<float>& contrast, const Grid& grid);

/// The contrast that a mask shows around each voxel (Gaussian of 8 mm); what shows more of it counts more. 0 far from
/// all of it.
/// @param contrast  as above
std::vector<float> usual_contrast(const Mask& of, const std::vector<float>& contrast, const Grid& grid);

}  // namespace supine::segmentation
