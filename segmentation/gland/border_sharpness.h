// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/gland/fat_level.h"
#include "segmentation/masks.h"

namespace supine::segmentation {

/// Of what looks like gland, the voxels whose borders nearby are sharp. Suppression that fails does so little by
/// little, over centimetres; gland ends within a voxel or two.
///
/// At each border voxel the steepest contrast beside it is taken over 2 mm, as a share of the contrast of what looks
/// like gland around there; the mean of the borders around a voxel decides.
/// @param looks  like gland; of grid.count() voxels, as inner, fat.contrast and what is returned
/// @param inner  where the contrast is known; holds looks
/// @return looks less what has no sharp border; what is far from any border stays
Mask with_sharp_borders(const Mask& looks, const Mask& inner, const FatLevel& fat, const Grid& grid);

}  // namespace supine::segmentation
