// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/gland.h"

#include <algorithm>
#include <cmath>

#include "segmentation/gland/fat_level.h"
#include "segmentation/gland/gland_outline.h"
#include "segmentation/gland/gland_place.h"
#include "segmentation/gland/tissue_classes.h"

namespace supine::segmentation {
namespace {

constexpr double under_skin_mm = 8;  // below the rind: fat in every breast, but for the nipple
constexpr double clear_of_noise = 4, pure_percentile = 0.98;
constexpr std::size_t fewest_pure = 100;
struct Range {
  double usual, lowest, highest;
};
constexpr Range dark_pure{0.6, 0.5, 0.68}, bright_pure{1.5, 0.5, 4};

/// Contrast of pure gland: near the upper end of what stands out of the noise.
double pure_contrast(const FatLevel& fat, const Mask& inner, GlandOptions::Contrast contrast) {
  const Range& range = contrast == GlandOptions::Contrast::dark ? dark_pure : bright_pure;
  std::vector<float> clear;
  for (std::size_t n = 0; n < inner.size(); ++n)
    if (inner[n] && fat.contrast[n] > clear_of_noise * fat.deviation[n]) clear.push_back(fat.contrast[n]);
  if (clear.size() < fewest_pure) return range.usual;
  const auto at = clear.begin() + static_cast<std::ptrdiff_t>(pure_percentile * static_cast<double>(clear.size() - 1));
  std::nth_element(clear.begin(), at, clear.end());
  return std::clamp<double>(*at, range.lowest, range.highest);
}

double volume_ml(const Mask& mask, const Grid& grid) {
  return static_cast<double>(std::count(mask.begin(), mask.end(), 1)) * grid.voxel_volume_mm3() / 1000;
}

/// Takes out of @p inner where fat is so bright that its suppression failed. @return how much, ml
double take_out_failed(const FatLevel& fat, double share, const Grid& grid, Mask& inner) {
  std::size_t count = 0;
  for (std::size_t n = 0; n < inner.size(); ++n)
    if (inner[n] && fat.shading[n] > share) {
      inner[n] = 0;
      ++count;
    }
  return static_cast<double>(count) * grid.voxel_volume_mm3() / 1000;
}

}  // namespace

GlandResult find_gland(const GreyImage& image, const GlandPlace& place, const GlandOptions& options) {
  const Grid& grid = image.grid;
  const Depths depths = measure_depths(place, grid);
  Mask inner(place.breast.size()), under_skin(inner.size());
  for (std::size_t n = 0; n < inner.size(); ++n) {
    inner[n] = place.breast[n] && depths.skin_mm[n] > options.skin_mm && depths.chest_mm[n] > options.chest_mm;
    under_skin[n] = inner[n] && depths.skin_mm[n] < options.skin_mm + under_skin_mm;
  }
  const FatLevel fat = find_fat_level(image, inner, under_skin, options);
  GlandResult result;
  result.fat_sd = fat.sd;
  for (std::size_t n = 0; n < inner.size(); ++n)
    if (inner[n]) {
      result.shading_low = std::min<double>(result.shading_low, fat.shading[n]);
      result.shading_high = std::max<double>(result.shading_high, fat.shading[n]);
    }
  if (options.contrast == GlandOptions::Contrast::bright)
    result.failed_ml = take_out_failed(fat, options.failed_share, grid, inner);
  result.pure = pure_contrast(fat, inner, options.contrast);
  const GlandClasses classes =
      classify_gland(fat.contrast, fat.deviation, inner, grid, result.pure, options.neighbourhood);
  Mask looks(inner.size());
  for (std::size_t n = 0; n < looks.size(); ++n) looks[n] = classes.probability[n] > 0.5f;
  const Mask sure = where_gland_lies(looks, place, depths, grid, options);
  result.aside_ml = volume_ml(looks, grid) - volume_ml(sure, grid);
  result.gland = outline_gland(sure, where_gland_may_lie(inner, place, depths, grid, options), fat, grid, options);
  result.fraction.assign(inner.size(), 0);
  Mask near(sure.size());
  for (std::size_t n = 0; n < near.size(); ++n) near[n] = sure[n] || result.gland[n];
  near = dilate(near, grid, options.bridge_mm);
  for (std::size_t n = 0; n < inner.size(); ++n) {
    const float share = std::clamp<float>(fat.contrast[n] / static_cast<float>(result.pure), 0, 1);
    if (near[n] && inner[n]) result.fraction[n] = (result.gland[n] ? 1 : classes.probability[n]) * share;
  }
  return result;
}

}  // namespace supine::segmentation
