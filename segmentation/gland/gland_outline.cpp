// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/gland_outline.h"

#include <algorithm>
#include <cmath>

#include "segmentation/blur.h"

namespace supine::segmentation {
namespace {

constexpr double around_mm = 8;          // standard deviation of "around there"
constexpr double single_voxel_mm = 0.8;  // noise of single voxels is smoothed by this much
constexpr float least_weight = 1e-4F;

/// The contrast that sure gland has around each voxel; what shows more of it counts more. 0 far from all of it.
std::vector<float> usual_contrast(const Mask& sure, const FatLevel& fat, const Grid& grid) {
  std::vector<float> sum(sure.size(), 0), weight(sure.size(), 0);
  for (std::size_t n = 0; n < sure.size(); ++n)
    if (sure[n]) {
      weight[n] = std::max(0.0F, fat.contrast[n]);
      sum[n] = weight[n] * weight[n];
    }
  gaussian_blur(sum, grid, around_mm);
  gaussian_blur(weight, grid, around_mm);
  for (std::size_t n = 0; n < sum.size(); ++n) sum[n] = weight[n] > least_weight ? sum[n] / weight[n] : 0;
  return sum;
}

/// The contrast without the noise of single voxels; what lies outside does not take part.
std::vector<float> smooth_contrast(const Mask& possible, const FatLevel& fat, const Grid& grid) {
  std::vector<float> sum(possible.size(), 0), weight(possible.begin(), possible.end());
  for (std::size_t n = 0; n < sum.size(); ++n)
    if (possible[n]) sum[n] = fat.contrast[n];
  gaussian_blur(sum, grid, single_voxel_mm);
  gaussian_blur(weight, grid, single_voxel_mm);
  for (std::size_t n = 0; n < sum.size(); ++n) sum[n] = possible[n] ? sum[n] / std::max(weight[n], least_weight) : 0;
  return sum;
}

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
  const std::vector<float> usual = usual_contrast(sure, fat, grid), contrast = smooth_contrast(possible, fat, grid);
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
