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

/// The largest ball that closes a tunnel or takes a strand away: both are twice as wide at the most.
inline constexpr double largest_ball_mm = 4;

/// Closes thin handles in the tissue that is meshed: fills tunnels, and takes away strands that hold on at both ends. A
/// segmentation's noise makes them where tissue is thin or folded; a breast has none, and no surface coarser than
/// voxels can go round one without crossing itself.
///
/// What closing or opening by balls of 1 to 2.3 voxels, then up to largest_ball_mm, changes is tried piece by piece,
/// fills first, and kept where it raises the Euler characteristic of the surface without making a cavity or cutting a
/// piece off.
/// @post  an image without handles is left as it is; so are handles thicker than both 4 voxels and 8 mm
HandleRepair close_handles(segmentation::LabelImage& image);

}  // namespace supine::reconstruction
