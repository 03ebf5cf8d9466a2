// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "segmentation/gland/fat_level.h"
#include "segmentation/gland/gland.h"

namespace supine::segmentation {

/// A second series of the same visit, on the grid of the first.
struct SecondSeries {
  GreyImage image;           ///< fat has the grey 100, roughly; NaN where the series does not reach
  Eigen::Vector3d shift_mm;  ///< that takes a point of the first to the same tissue in the second
};

/// Lays a series over the first: the shift, by up to 10 mm along each axis, at which its edges lie best on those in and
/// around the breast (normalised gradient fields: what is bright in one may be dark in the other). Each voxel is the
/// mean over itself.
/// @param image  the first series
/// @param under_skin  voxels of the breast that are mostly fat
/// @throws InputError  a series that shows another body, lies further away, reaches over less than nine tenths of
///   the breast, or has no fat brighter than its noise
SecondSeries lay_over(const GreyImage& series, const GreyImage& image, const Mask& breast, const Mask& under_skin);

/// What one series says of fat and gland; a voxel with share f of gland has the contrast f times `pure`.
struct SeriesContrast {
  FatLevel fat;
  double pure;
  Mask usable;  ///< where it says anything
};

/// Of gland that both show.
/// @throws InputError  a second series that has gland on the other side of fat where the first shows it clearly: of
///   another kind than was said
void check_contrast(const SeriesContrast& first, const SeriesContrast& second);

/// The share of gland that two series say together, with its standard deviation, as the contrast of one series whose
/// pure gland has 1: (Σ c p / s²) / (Σ p² / s²), over those of contrast c, scatter s and pure contrast p that are
/// usable. Exact for normal scatter: what is left of the two contrasts is the same whatever the share.
FatLevel share_by_both(const SeriesContrast& first, const SeriesContrast& second);

}  // namespace supine::segmentation
