// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "segmentation/gland/second_series.h"

namespace supine::segmentation {

/// Where a second series was laid too far aside, and how far fat lies from where it is, mm: a scanner that places
/// tissues by their frequency moves fat along one axis of the image (chemical shift), and with it the holes that gland
/// leaves in the fat, but not the gland's own grey.
struct FatShift {
  Eigen::Vector3d laid_mm = Eigen::Vector3d::Zero(), fat_mm = laid_mm;
};

/// The shifts d of at most 4 mm, along an axis within the slices, and e of at most 1.5 mm with which the grey around
/// gland is best made of 1 - f(x + e) and f(x + e + d); none where d makes what is left less than 8 % smaller.
/// @param image  without fat suppression
/// @param share  f: of gland, by a second series that was laid over the first
/// @param within  where f is known
FatShift find_fat_shift(const GreyImage& image, const std::vector<float>& share, const Mask& within);

/// The axes along which voxels are short: along thick slices nothing is read out by frequency.
std::vector<int> axes_of_slices(const Grid& grid);

/// What stands at x + @p shift_mm, at x; unusable where that is beyond the image.
SeriesContrast moved(const SeriesContrast& contrast, const Grid& grid, const Eigen::Vector3d& shift_mm);

}  // namespace supine::segmentation
