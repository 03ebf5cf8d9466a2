// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "segmentation/gland/gland.h"

namespace supine::segmentation {

/// The grey of fat at every place of a breast, and how it scatters there.
struct FatLevel {
  std::vector<float>
      contrast;  ///< per voxel of the grid: 0 fat; 0.7 = 70 % darker (dark) or brighter (bright) than fat
  std::vector<float> deviation;  ///< of the fat's contrast
  std::vector<float> shading;    ///< the fat's grey over its median in the breast
  double sd = 0;                 ///< the median deviation over the breast
};

/// Fits it: see find_gland.
/// @param inner  the voxels of the breast that may be fat or gland
/// @param under_skin  those of them that are surely mostly fat
/// @throws InputError  when there are fewer than 1000 of either
FatLevel find_fat_level(const GreyImage& image, const Mask& inner, const Mask& under_skin,
                        GlandOptions::Contrast contrast, double shading_mm);

}  // namespace supine::segmentation
