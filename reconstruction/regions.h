// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "reconstruction/voxel_surface.h"
#include "segmentation/support_voxels.h"

namespace supine::reconstruction {

/// Where the model may end in a cut face although the body goes on.
struct CutRules {
  bool excluded = false;  ///< next to the tissue `excluded`
  bool edge = false;      ///< at the edge of the image
  bool rim = false;       ///< where tissue other than skin and nipple borders on air within rim_mm of the muscle
  double rim_mm = 10;     ///< > 0
};

/// Islands of one region inside another that are smaller than this are noise of the labels.
inline constexpr double smallest_island_mm2 = segmentation::smallest_contact_mm2;

/// Gives every triangle of the breast's surface its region, from the voxel beyond it: muscle → inner, air → skin,
/// excluded, image edge and bare rim → cut where the rules allow it.
///
/// The voxels' word is averaged over a few rings of triangles and islands smaller than smallest_island_mm2 go to the
/// region that surrounds them most, so that regions border on each other in clean curves.
/// @param breast  voxel_surface(image, meshed_tissues())
/// @return #T values of Region: inner, skin or cut
/// @throws InputError  a cut the rules do not allow: names the tissue, the place in mm, how many voxel faces there are,
///   and the line of case.toml that would allow it
Eigen::VectorXi regions_of(const VoxelSurface& breast, const segmentation::LabelImage& image, const CutRules& rules);

}  // namespace supine::reconstruction
