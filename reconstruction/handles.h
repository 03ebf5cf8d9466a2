// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "segmentation/image.h"

namespace supine::reconstruction {

/// What was done about handles of a body.
struct HandleRepair {
  long genus_before = 0, genus = 0;        ///< of the surface around all tissue that is meshed
  double filled_mm3 = 0, removed_mm3 = 0;  ///< tissue added in tunnels, taken away in strands
  std::vector<Eigen::Vector3d> places_mm;  ///< the middle of each change, patient LPS
};

/// Closes handles as thin as voxels in the tissue that is meshed: fills tunnels, and takes away strands that hold on at
/// both ends. A segmentation's noise makes them where tissue is thin or folded; a breast has none, and no surface
/// coarser than voxels can go round one without crossing itself.
///
/// What closing or opening by balls of 1 to 2.3 voxels changes is tried piece by piece, fills first, and kept where it
/// raises the Euler characteristic of the surface without making a cavity or cutting a piece off.
/// @post  an image without handles is left as it is; so are handles thicker than 4 voxels
HandleRepair close_handles(segmentation::LabelImage& image);

}  // namespace supine::reconstruction
