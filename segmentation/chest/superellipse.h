// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

namespace supine::segmentation {

/// The rough cross-section of a chest as a superellipse (Lamé curve): |x / half_width|^power + |y / depth|^power = 1
/// about the rays' centre, the depth changing linearly with z; on it a plate as the pectoral muscles are, from beside
/// the sternum to their outer edges.
struct Superellipse {
  double half_width_mm = 140;
  double depth_mm = 72;    ///< at z = middle_z_mm
  double depth_slope = 0;  ///< d depth / dz
  double power = 2.5;
  double middle_z_mm = 0;
  double plate_mm = 0;         ///< thickness of the muscle, toward the front; >= 0
  double plate_edge_mm = 95;   ///< of its outer edge from the middle line
  double plate_low_mm = -300;  ///< level z at which its lower end is half as thick

  double radius_mm(double angle_rad, double z_mm) const;
};

/// Tries the superellipses a chest may have (half width 100 to 175 mm, front 3 to 45 mm under the skin of the cleft,
/// front tilted up to 22 degrees) and returns the one with the lowest sum of costs.
/// @param cost  summed over the border for one of them
/// @param centre_depth_mm  of the rays' centre behind the skin over the sternum
Superellipse best_superellipse(const std::function<double(const Superellipse&)>& cost, double centre_depth_mm,
                               double middle_z_mm);

/// Narrow, middling and wide chests, each as the best of it is without plates and with plates of 4 to 15 mm, whose
/// outer edge is 75 to 120 mm from the middle line: with any lower end, with one 15 to 45 mm under the middle level,
/// and with one 40 to 70 mm. Where the sides are hardly seen and the sum of costs is coarse, which of them is right
/// shows only along the border itself.
/// @param cost, centre_depth_mm, middle_z_mm  as for best_superellipse
/// @return  for each width, the one with the lowest sum first
std::vector<std::vector<Superellipse>> superellipses_with_plates(const std::function<double(const Superellipse&)>& cost,
                                                                 double centre_depth_mm, double middle_z_mm);

}  // namespace supine::segmentation
