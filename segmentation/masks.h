// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "segmentation/image.h"

namespace supine::segmentation {

/// A set of voxels: 1 in, 0 out; Grid::index order.
using Mask = std::vector<std::uint8_t>;

/// Components through voxel faces (6-connected), numbered from 1 in the order of their first voxel.
struct Components {
  std::vector<std::int32_t> number;  ///< per voxel; 0 = outside the mask
  std::vector<std::size_t> size;     ///< voxels of component n at [n - 1]
};
Components connected_components(const Mask& mask, const Grid& grid);

/// How many components of equal value there are, per value.
std::array<std::size_t, 256> component_counts(std::span<const std::uint8_t> values, const Grid& grid);

/// What is reached from the seeds through voxel faces over voxels of @p allowed; seeds outside it reach nothing.
Mask flood(const Mask& allowed, const Grid& grid, std::span<const std::size_t> seeds);

/// Keeps the largest `keep` components (0 = all; ties by first voxel), and of those the ones with at least min_voxels.
Mask keep_islands(const Mask& mask, const Grid& grid, std::size_t keep, double min_voxels);

/// Adds the components of the complement that do not touch the edge of the image and have at most max_voxels.
Mask fill_holes(const Mask& mask, const Grid& grid, double max_voxels);

/// Squared distance in mm^2 from each voxel centre to the nearest voxel centre of the mask; infinity when it is empty.
/// Exact (lower envelope of parabolas per axis, Felzenszwalb and Huttenlocher 2012), spacing honoured.
std::vector<float> squared_distance_mm2(const Mask& mask, const Grid& grid);

/// Voxels whose centre is within radius_mm of one of the mask's (dilate), or farther than radius_mm from every voxel
/// centre outside it (erode). Beyond the image is neither inside nor outside.
Mask dilate(const Mask& mask, const Grid& grid, double radius_mm);
Mask erode(const Mask& mask, const Grid& grid, double radius_mm);

}  // namespace supine::segmentation
