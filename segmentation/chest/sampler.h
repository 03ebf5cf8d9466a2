// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>

#include "segmentation/masks.h"

namespace supine::segmentation {

/// Trilinear grey at a patient point; NaN outside the box of the voxel centres (half a voxel of slack).
inline float sample(const GreyImage& image, const Eigen::Vector3d& point_mm) {
  const Grid& grid = image.grid;
  Eigen::Vector3d at = grid.continuous_index(point_mm);
  Eigen::Vector3i low;
  for (int a = 0; a < 3; ++a) {
    const double last = grid.size[a] - 1;
    if (!(at[a] >= -0.5 && at[a] <= last + 0.5)) return std::numeric_limits<float>::quiet_NaN();
    at[a] = std::min(std::max(at[a], 0.0), last);
    low[a] = std::min(static_cast<int>(at[a]), std::max(0, grid.size[a] - 2));
    at[a] -= low[a];
  }
  double value = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3i n = low;
    double weight = 1;
    for (int a = 0; a < 3; ++a) {
      const bool upper = corner >> a & 1;
      weight *= upper ? at[a] : 1 - at[a];
      n[a] += upper;
    }
    if (weight > 0) value += weight * image.at(n.x(), n.y(), n.z());
  }
  return static_cast<float>(value);
}

/// Whether the voxel nearest to a patient point is in the mask; false outside the image.
inline bool contains_point(const Mask& mask, const Grid& grid, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3i n = grid.continuous_index(point_mm).array().round().cast<int>();
  return grid.contains(n.x(), n.y(), n.z()) && mask[grid.index(n.x(), n.y(), n.z())];
}

}  // namespace supine::segmentation
