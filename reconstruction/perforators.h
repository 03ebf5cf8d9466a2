// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/image.h"

namespace supine::reconstruction {

/// Turns perforators, thin strands of tissue that run into the muscle (perforating vessels, mostly), into muscle: no
/// tetrahedron of useful size fits into them, and the breast does not slide along them.
///
/// A perforator is a piece of what opening by a ball takes away that is longer than the ball is thick, borders on
/// nothing but muscle and meshed tissue, and on muscle more than twice as much.
/// @param thinnest_mm  diameter of the ball, >= 0; 0 = nothing is changed
/// @return volume turned, mm³
double turn_perforators_into_muscle(segmentation::LabelImage& image, double thinnest_mm);

}  // namespace supine::reconstruction
