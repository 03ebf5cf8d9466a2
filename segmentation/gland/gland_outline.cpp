// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/gland_outline.h"

#include <algorithm>
#include <cmath>

#include "segmentation/gland/contrast_around.h"

namespace supine::segmentation {
namespace {

/// Those components of the mask, with gaps up to bridge_mm, that hold sure gland.
void keep_what_holds(const Mask& sure, const Grid& grid, double bridge_mm, Mask& mask) {
  const Components pieces = connected_components(bridge_mm > 0 ? dilate(mask, grid, bridge_mm / 2) : mask, grid);
  std::vector<std::uint8_t> holds(pieces.size.size() + 1, 0);
  for (std::size_t n = 0; n < mask.size(); ++n)
    if (sure[n] && mask[n]) holds[pieces.number[n]] = 1;
  for (std::size_t n = 0; n < mask.size(); ++n) mask[n] = mask[n] && holds[pieces.number[n]];
}

}  // namespace

Mask outline_gland(const Mask& sure, const Mask& possible, const FatLevel& fat, const Grid& grid,
                   const GlandOptions& options) {
  const std::vector<float> usual = usual_contrast(sure, fat.contrast, grid),
                           contrast = smooth_contrast(possible, fat.contrast, grid);
  Mask outline(sure.size());
  for (std::size_t n = 0; n < outline.size(); ++n) {
    const double least =
        std::max(options.least_deviations * fat.deviation[n], options.least_share * static_cast<double>(usual[n]));
    outline[n] = possible[n] && usual[n] > 0 && contrast[n] >= least;
  }
  keep_what_holds(sure, grid, options.bridge_mm, outline);
  if (options.gap_mm <= 0) return outline;
  const Mask closed = erode(dilate(outline, grid, options.gap_mm), grid, options.gap_mm);
  for (std::size_t n = 0; n < outline.size(); ++n) outline[n] = outline[n] || (closed[n] && possible[n]);
  return outline;
}

}  // namespace supine::segmentation
