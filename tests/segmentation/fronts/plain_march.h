// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/fronts/fast_marching.h"

namespace supine::segmentation::testing {

/// Fast marching as the textbook has it, in doubles: one heap in the exact order of the times, every neighbour's
/// stencil gathered anew. Sources at voxel centres only, with their own voxel.
Image<double> plain_march(const Image<float>& speed, const std::vector<FrontSource>& sources, int order);

}  // namespace supine::segmentation::testing
