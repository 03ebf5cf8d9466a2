// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "segmentation/masks.h"

namespace supine::segmentation {

/// The front of a body lying prone: for every column (x, z) of patient coordinates the first point of the body met when
/// going from the front (-y) to the back. Works on any grid, oblique or flipped.
struct FrontSkin {
  double x0_mm = 0, z0_mm = 0, step_x_mm = 1, step_z_mm = 1;
  Eigen::ArrayXXd y_mm;  ///< nx by nz; NaN where the column misses the body

  double x(Eigen::Index i) const { return x0_mm + static_cast<double>(i) * step_x_mm; }
  double z(Eigen::Index k) const { return z0_mm + static_cast<double>(k) * step_z_mm; }
  /// Of the column nearest to (x, z); NaN outside.
  double at(double x_mm, double z_mm) const;
};
/// @param step_mm  of the columns along x; along z it is the grid's finest step that moves along z
FrontSkin front_skin(const Mask& body, const Grid& grid, double step_mm = 1.5);

/// Where the middle of the chest is.
struct Torso {
  double sternum_x_mm = 0;       ///< at z = 0
  double sternum_slope = 0;      ///< dx/dz of the middle line
  double sternum_skin_y_mm = 0;  ///< median depth of the skin over it, between the breasts
  int slices = 0;                ///< that show a cleft between two breasts

  double sternum_x(double z_mm) const { return sternum_x_mm + sternum_slope * z_mm; }
};

/// Finds the middle line as the cleft between two breasts that hang at least `least_mm` below it.
/// @param sternum_x_mm  the user's own middle line instead
/// @throws InputError  when fewer than three levels show a cleft and the user gives no middle line
Torso find_torso(const FrontSkin& front, std::optional<double> sternum_x_mm = {}, double least_mm = 15);

}  // namespace supine::segmentation
