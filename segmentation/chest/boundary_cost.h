// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "segmentation/chest/ray_profiles.h"

namespace supine::segmentation {

/// What each sample of the rays costs as the place of the wall, 0 (a clear border) to about 2, in the order of
/// RayProfiles::values. Samples outside the body or next to the centre cost 4; rays that show nothing cost 0.
/// Border::step: how bright it is within band_mm inside, plus how dark outside (means of 0 to 1). Border::line: 1.5
/// less what a dark line and the rise from muscle to fat take off. Both: plus far_weight times what speaks for a border
/// farther out.
/// @param strong_steps  Border::line: a step of twice a clear one to what is surely fat counts as much as a line. For
/// looks
///   near to what is known: farther in, lung and heart make such steps too.
std::vector<float> boundary_costs(const RayProfiles& profiles, const ChestWallOptions& options,
                                  bool strong_steps = false);

}  // namespace supine::segmentation
