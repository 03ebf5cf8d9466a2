// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "reconstruction/surface.h"

namespace supine::reconstruction {

struct FairingOptions {
  double length_mm =
      3;  ///< bends shorter than about 2π of it are flattened against what the voxels say; >= 0, 0 = none
  Eigen::Vector3d spacing_mm;  ///< voxel size along the axes of the points
  int iterations = 150;        ///< steps of the staircase up to some 0.15 × iterations voxels long are found
  int give_back = 24;          ///< averaging passes over the displacement that is taken back, see fair()
};

/// The smoothest surface that agrees with the voxels.
///
/// A label map says of every point of its staircase surface only that the true surface passes between two voxel
/// centres, half a voxel to either side. So a point moves freely within half a voxel of its start along each axis, and
/// pays the square of what it goes beyond. Minimised is  ½ Σ |x − P(x)|² + 8 (length/h)⁴ Σ |L x|²,  P the nearest point
/// of the free box, h the mean edge, L the umbrella Laplacian, by accelerated gradients (FISTA with restart, Beck and
/// Teboulle 2009). Steps of the staircase vanish whatever their length, while nothing wider than a voxel can shrink.
///
/// Where two regions meet, the border is faired as a curve and the surface may keep its edge there; the same holds for
/// the rim of an open surface. Corners where three borders meet have no bending.
/// @param surface  points along the image axes, mm, in the middle between two voxels; regions or none
/// @return the moved points; the same for any number of threads
Points fair(const Surface& surface, const FairingOptions& options);

}  // namespace supine::reconstruction
