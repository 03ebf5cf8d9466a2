// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "phantom/scan.h"

namespace supine::phantom {

/// How far a scan and its landmarks lie from where they should: turned about the scan's centroid, then shifted.
struct Placement {
  Eigen::Vector3d shift_mm, turn_rad;  ///< LPS; rotation vector
};

/// @p first and then @p second, each about where the centroid is by then.
Placement after(const Placement& first, const Placement& second);

void move_scan(const Placement& placement, Scan& scan);

}  // namespace supine::phantom
