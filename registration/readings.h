// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "registration/problem.h"

namespace supine::registration {

/// Refuses a scan whose size is not that of the body, and names the unit that fits (m, cm, inch, µm).
///
/// With three landmarks or more: their spread in the scan against that on the body. Else: the diagonal of the scan
/// against that of the body, which must lie within 0.15 to 6; the unit is told by fitting the scan in each.
/// @param name  of the scan's file
/// @throws InputError  empty scan, coordinates not finite, another unit, landmarks of another body
void check_unit(const Problem& problem, const std::string& name);

/// Refuses a scan whose mirror image fits far better (half of the error, and more than @p score_mm = 3 mm to gain
/// from), and says which axis is negated or which two are swapped.
/// @param score_mm  of the placement that was found
/// @throws InputError
void check_mirror(const Problem& problem, const RigidTransform& placement, double score_mm, const std::string& name);

/// What a change of axes (of axis_changes()) does: "x and y negated (RAS)", "axes swapped (read its x, y, z as …)".
std::string axis_change_words(const Eigen::Matrix3d& change);

/// "x and y negated (RAS)" and the like where the turn is within 15° of a change of axes other than none; else empty.
std::string named_axis_change(const Eigen::Matrix3d& rotation);

}  // namespace supine::registration
