// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "warp/point_file.h"
#include "warp/warp_volume.h"

namespace supine::warp {

/// Points carried from one shape into the other.
struct CarriedPoints {
  Points places;                  ///< #P by 3; those too far outside stay where they were
  Eigen::VectorXd outside_mm;     ///< #P, of each point from the body in the source shape; 0 inside
  std::vector<bool> was_carried;  ///< #P
  /// Of connected groups: how far the carried middle of two control points lies from the middle of the carried ones, at
  /// most, mm. What a curve between its points is off by.
  std::vector<double> between_mm;

  std::size_t left_behind() const;
};

/// A point this far outside the body is still taken as one of its surface, mm: voxels and hands are not exact.
inline constexpr double on_surface_mm = 3;

/// @throws InputError  every point lies further outside than on_surface_mm, saying whether another frame would fit
/// @param name  of the points, for the message
CarriedPoints carry_points(const TwoShapes& shapes, const Points& points, const std::vector<PointGroup>& groups,
                           const std::string& name);

}  // namespace supine::warp
