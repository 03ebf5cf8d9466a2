// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/gland/fat_level.h"
#include "segmentation/gland/gland.h"

namespace supine::segmentation {

/// What a reader outlines around what is surely gland.
///
/// A border runs where the contrast falls to least_share of what gland has around there: where strands are thinner than
/// voxels their own contrast is low, and so is that of their border. Strands that begin at sure gland are followed that
/// far, but not into the fat's scatter; gaps narrower than twice gap_mm are filled.
/// @param sure  gland for certain
/// @param possible  the voxels where gland may lie
Mask outline_gland(const Mask& sure, const Mask& possible, const FatLevel& fat, const Grid& grid,
                   const GlandOptions& options);

}  // namespace supine::segmentation
