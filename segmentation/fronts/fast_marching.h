// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <limits>
#include <span>

#include "segmentation/masks.h"

namespace supine::segmentation {

/// Where a front starts.
struct FrontSource {
  Eigen::Vector3d point_mm;  ///< patient coordinates; need not be a voxel centre
  double time = 0;           ///< >= 0
};

struct FastMarchingOptions {
  int order = 2;  ///< of the one-sided differences, 1 or 2 (2 falls back to 1 where the second neighbour is not known)
  double stop_time = std::numeric_limits<double>::infinity();  ///< the front stands still then; > 0
  /// Voxels this near to a source get the straight way's time at the source's speed: the arrival time has a corner
  /// there that no difference sees, and the error it makes spreads over the whole volume. 0 = the eight voxels around
  /// it.
  double source_radius_mm = 0;
};

/// Arrival time of a front that leaves the sources and moves with the given speed: the solution of |grad T| = 1 / speed
/// by fast marching (J. A. Sethian 1999, section 8.3 first and 8.9 second order) in the exact order of the times. A
/// voxel is first solved for when it might pass at the earliest: no sooner than 1 / (v sqrt(sum 1 / h^2)) after its
/// first neighbour, v the greatest speed (two thirds of that in second order). Voxels may be anisotropic; the grid may
/// be oblique. The result does not depend on the number of threads.
/// @param speed  mm per unit of time, finite and >= 0; a front does not enter voxels of speed 0
/// @return time per voxel; infinity where the front did not come before stop_time
/// @throws InputError  options out of range; more than about 4e9 voxels; no source; a source outside the image (in mm,
///   with the image's box) or where the speed is 0 (in mm); a negative or not finite speed (voxel)
Image<float> fast_march(const Image<float>& speed, std::span<const FrontSource> sources,
                        const FastMarchingOptions& options);

/// Speed 1 / (1 + (|grad g| / half)^2): slow at edges. Central differences of the image smoothed by a Gaussian.
/// @param sigma_mm  of the Gaussian, >= 0  @param half_per_mm  gradient at which the speed is a half; > 0
/// @throws InputError  parameters out of range
Image<float> speed_from_gradient(const GreyImage& image, double sigma_mm, double half_per_mm);

/// Speed exp(-(g - mean)^2 / (2 sd^2)): fast where the grey is that of the tissue. Below 1e-4 it is 0.
/// @throws InputError  sd not > 0
Image<float> speed_from_greys(const GreyImage& image, double mean, double sd);

}  // namespace supine::segmentation
