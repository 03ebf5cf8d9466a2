// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "segmentation/image.h"

namespace supine::segmentation {

/// Smooths a field in place by three passes of a box along each axis, which is a Gaussian of standard deviation
/// @p sigma_mm to within 3 %. Beyond the image the field counts as 0 with weight 0 (no brightening or darkening at the
/// edge).
/// @param field  size grid.count()
/// @param sigma_mm  > 0; an axis whose voxels are larger than 3 sigma is left alone
void gaussian_blur(std::vector<float>& field, const Grid& grid, double sigma_mm);

}  // namespace supine::segmentation
