// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace supine::meshing {

/// The place between two breasts: the x (LPS, mm) where what stands highest over the muscle is lowest between two
/// mounds; the middle of the flat floor there, or of the gap where the two are separate pieces.
/// @param heights  x and height over the muscle (mm) of pieces of skin, no larger than 3 mm
/// @throws InputError  no valley at least 5 mm lower than the mounds on either side of it
double find_cleft_x(const std::vector<Eigen::Vector2d>& heights);

}  // namespace supine::meshing
