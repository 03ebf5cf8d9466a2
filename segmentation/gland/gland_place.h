// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "segmentation/gland/gland.h"

namespace supine::segmentation {

/// Per voxel, mm: from what is outside the body, and from the chest; infinite where there is neither.
struct Depths {
  std::vector<float> skin_mm, chest_mm;
};
Depths measure_depths(const GlandPlace& place, const Grid& grid);

/// Where a breast's gland spreads from, and into.
struct Fan {
  bool there = false;                                   ///< whether the side has a breast
  Eigen::Vector3d nipple_mm = Eigen::Vector3d::Zero();  ///< the foremost place of the breast
  Eigen::Vector3d inward = Eigen::Vector3d::UnitY();    ///< from there to the middle of the breast
};
/// Of the right (0) and the left (1) breast.
std::array<Fan, 2> find_fans(const GlandPlace& place, const Grid& grid);

/// Those voxels of a mask where gland may lie: in a breast's fan, not too far back, and either deep or near the nipple.
Mask where_gland_may_lie(const Mask& within, const GlandPlace& place, const Depths& depths, const Grid& grid,
                         const GlandOptions& options);

/// Of what looks like gland and may be, the pieces that are large enough and either deep or at the nipple.
Mask where_gland_lies(const Mask& looks, const GlandPlace& place, const Depths& depths, const Grid& grid,
                      const GlandOptions& options);

}  // namespace supine::segmentation
