// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/masks.h"
#include "segmentation/steps/recipe.h"

namespace supine::segmentation {

struct GrowResult {
  Mask mask;
  GreyRange range;  ///< the greys it grew over in the end
};

/// Seeded region growing; see Grow. @param within  empty = the whole image
/// @throws InputError  naming the seed in mm: outside the image, outside `within`, or its grey outside the range
GrowResult grow(const GreyImage& image, const Grow& step, const Mask& within);

}  // namespace supine::segmentation
