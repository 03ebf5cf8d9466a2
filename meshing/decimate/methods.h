// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/decimate/measure.h"

namespace supine::meshing {

/// Each returns its best surface within the bound, with distances and reached_target, or one without triangles and the
/// reason when there is none.
DecimateResult decimate_to_quads(const DecimateMeasure& measure, const DecimateOptions& options);
DecimateResult decimate_to_triangles(const DecimateMeasure& measure, const DecimateOptions& options);

}  // namespace supine::meshing
