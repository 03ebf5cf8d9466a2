// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "segmentation/masks.h"

namespace supine::segmentation {

/// The share of gland by one series without fat suppression in which the scanner moved the fat (chemical shift,
/// fat_shift.h), told from that series alone.
struct MovedFat {
  Eigen::Vector3d fat_mm;    ///< from where fat is to where the series shows it, in the frame of the grid
  std::vector<float> share;  ///< of gland, 0 to 1 per voxel of the grid where it is; 0 outside the mask
};

/// Gland f leaves its hole in the fat at x - d, its own grey w (of fat's) at x, so that the contrast is
///   c(x) = f(x - d) - w f(x):
/// one flank of gland is void, the other brighter than fat. f between 0 and 1 is fitted to c by least squares
/// (accelerated projected gradient, Beck and Teboulle, SIAM J. Imaging Sci. 2, 2009), along lines, for shifts of up to
/// 2.5 mm and 1.75 voxels (some of 1.4 mm together where they are finer) along the axes within the slices. Fitted to
/// the opposite shift the same image leaves more: the shift is told where it leaves e^-0.35 of that and six tenths of
/// what a shift of a quarter of a voxel leaves.
/// @param contrast  one per voxel of @p grid: 0 fat, @p pure gland (0.6 = 60 % darker than fat)
/// @param within  of @p grid, where anything is known; fewer than a thousand voxels tell nothing
/// @param pure  1 - w, in (0, 1)
/// @return nothing where no shift is told
std::optional<MovedFat> find_moved_fat(const std::vector<float>& contrast, const Mask& within, const Grid& grid,
                                       double pure);

}  // namespace supine::segmentation
