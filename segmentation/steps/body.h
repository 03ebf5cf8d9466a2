// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/masks.h"
#include "segmentation/steps/recipe.h"

namespace supine::segmentation {

/// Finds the body; see recipe.h. @throws InputError  when no voxel is as bright as step.lower, or no air is in front
Mask find_body(const GreyImage& image, const Body& step);

}  // namespace supine::segmentation
