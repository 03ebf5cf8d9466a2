// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "segmentation/chest/chest_wall.h"

namespace supine::segmentation {

/// A stretch of the chest wall where the image shows no border, so that tissue may leak into the muscle or back.
struct Leak {
  Eigen::Vector3d middle_mm;
  double area_cm2 = 0;
  double size_mm = 0;  ///< of its bounding box, along the longest side
};

/// Patches of the wall, in front of @p back_y_mm, whose cost says that most of what a border shows is missing;
/// largest first.
/// @param least_cm2  smaller patches are noise
std::vector<Leak> find_leaks(const ChestWall& wall, double back_y_mm, double least_cm2 = 5);

/// Patches of the wall, in front of @p back_y_mm on both sides, where one side of the chest lies much farther forward
/// than the other, beyond what the whole chest does (a body that lies turned): chests are even to within a few
/// millimetres, so one side is wrong. The middle is that of the side that lies in front. Largest first.
std::vector<Leak> find_uneven(const ChestWall& wall, double back_y_mm, double least_cm2 = 5);

/// A line for a person.
std::string describe(const Leak& leak);
std::string describe_uneven(const Leak& patch);

}  // namespace supine::segmentation
