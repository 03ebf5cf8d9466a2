// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/gland.h"

#include <algorithm>
#include <cmath>

#include "segmentation/gland/border_sharpness.h"
#include "segmentation/gland/fat_level.h"
#include "segmentation/gland/fat_shift.h"
#include "segmentation/gland/gland_outline.h"
#include "segmentation/gland/gland_place.h"
#include "segmentation/gland/moved_fat.h"
#include "segmentation/gland/second_series.h"
#include "segmentation/gland/tissue_classes.h"

namespace supine::segmentation {
namespace {

constexpr double under_skin_mm = 8;  // below the rind: fat in every breast, but for the nipple
constexpr double clear_of_noise = 4, pure_percentile = 0.98;
constexpr std::size_t fewest_pure = 100;
constexpr double beside_failed_mm = 4;  // where suppression fails; there is no gland either
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

/// What a series says of the voxels of @p inner that it reaches, but where fat is so bright that its suppression
/// failed.
SeriesContrast contrast_in(const GreyImage& image, Mask inner, Mask under_skin, GlandOptions::Contrast contrast,
                           const GlandOptions& options) {
  for (std::size_t n = 0; n < inner.size(); ++n) {
    inner[n] = inner[n] && !std::isnan(image.voxels[n]);
    under_skin[n] = under_skin[n] && inner[n];
  }
  SeriesContrast series{find_fat_level(image, inner, under_skin, contrast, options.shading_mm), 0, inner};
  if (contrast == GlandOptions::Contrast::bright)
    for (std::size_t n = 0; n < inner.size(); ++n)
      series.usable[n] = inner[n] && series.fat.shading[n] <= static_cast<float>(options.failed_share);
  series.pure = pure_contrast(series.fat, series.usable, contrast);
  return series;
}

/// Of gland, by the contrast.
std::vector<float> share_of(const SeriesContrast& series) {
  std::vector<float> share(series.usable.size(), 0);
  for (std::size_t n = 0; n < share.size(); ++n)
    if (series.usable[n]) share[n] = std::clamp(series.fat.contrast[n] / static_cast<float>(series.pure), 0.0F, 1.0F);
  return share;
}

/// The share that both series say, where the gland itself lies: in a series without fat suppression its edges are those
/// of the fat, which the scanner moved.
SeriesContrast take_together(const GreyImage& image, const SeriesContrast& first, const SeriesContrast& second,
                             const GlandOptions& options, GlandResult::Second& said) {
  check_contrast(first, second);
  said.fat_sd = second.fat.sd, said.pure = second.pure;
  SeriesContrast both{share_by_both(first, second), 1, first.usable};
  for (std::size_t n = 0; n < both.usable.size(); ++n) both.usable[n] = both.usable[n] || second.usable[n];
  if (options.contrast == GlandOptions::Contrast::bright || !options.find_fat_shift) return both;
  const FatShift shift = find_fat_shift(image, share_of(second), second.usable);
  said.fat_shift_mm = shift.fat_mm;
  said.shift_mm += shift.laid_mm + shift.fat_mm;
  return moved(both, image.grid, shift.laid_mm + shift.fat_mm);
}

/// Gland where it is, in a series whose fat lies aside. @return by how much, where that is told
std::optional<Eigen::Vector3d> put_back(const Grid& grid, SeriesContrast& series) {
  const std::optional<MovedFat> moved = find_moved_fat(series.fat.contrast, series.usable, grid, series.pure);
  if (!moved) return {};
  for (std::size_t n = 0; n < series.usable.size(); ++n)
    if (series.usable[n]) series.fat.contrast[n] = static_cast<float>(series.pure) * moved->share[n];
  return moved->fat_mm;
}

/// Takes fat whose suppression fails little by little from what is surely gland, and it and what lies beside it from
/// where gland may be. @return ml of it
double leave_out_failed(const FatLevel& fat, const Grid& grid, Mask& sure, Mask& inner) {
  const Mask sharp = with_sharp_borders(sure, inner, fat, grid);
  Mask failed(sure.size());
  for (std::size_t n = 0; n < failed.size(); ++n) failed[n] = sure[n] && !sharp[n];
  const Mask beside = dilate(failed, grid, beside_failed_mm);
  for (std::size_t n = 0; n < failed.size(); ++n) inner[n] = inner[n] && (sharp[n] || !beside[n]);
  sure = sharp;
  return volume_ml(failed, grid);
}

void note_shading(const FatLevel& fat, const Mask& inner, GlandResult& result) {
  for (std::size_t n = 0; n < inner.size(); ++n)
    if (inner[n]) {
      result.shading_low = std::min<double>(result.shading_low, fat.shading[n]);
      result.shading_high = std::max<double>(result.shading_high, fat.shading[n]);
    }
}

}  // namespace

GlandResult find_gland(const GreyImage& image, const GlandPlace& place, const GlandOptions& options,
                       const GreyImage* second) {
  const Grid& grid = image.grid;
  const Depths depths = measure_depths(place, grid);
  Mask inner(place.breast.size()), under_skin(inner.size());
  for (std::size_t n = 0; n < inner.size(); ++n) {
    inner[n] = place.breast[n] && depths.skin_mm[n] > options.skin_mm && depths.chest_mm[n] > options.chest_mm;
    under_skin[n] = inner[n] && depths.skin_mm[n] < options.skin_mm + under_skin_mm;
  }
  GlandResult result;
  SeriesContrast series = contrast_in(image, inner, under_skin, options.contrast, options);
  result.fat_sd = series.fat.sd, result.pure = series.pure;
  note_shading(series.fat, inner, result);
  if (second != nullptr && options.second) {
    const SecondSeries laid = lay_over(*second, image, place.breast, under_skin);
    result.second = {laid.shift_mm, Eigen::Vector3d::Zero(), 0, 0};
    series = take_together(image, series, contrast_in(laid.image, inner, under_skin, *options.second, options), options,
                           *result.second);
    for (std::size_t n = 0; n < inner.size(); ++n) series.usable[n] = series.usable[n] && inner[n];
  } else if (options.contrast == GlandOptions::Contrast::dark && options.find_fat_shift)
    result.fat_shift_mm = put_back(grid, series);
  result.failed_ml = volume_ml(inner, grid) - volume_ml(series.usable, grid);
  inner = std::move(series.usable);
  const FatLevel& fat = series.fat;
  const GlandClasses classes =
      classify_gland(fat.contrast, fat.deviation, inner, grid, series.pure, options.neighbourhood);
  Mask looks(inner.size());
  for (std::size_t n = 0; n < looks.size(); ++n) looks[n] = classes.probability[n] > 0.5f;
  Mask sure = where_gland_lies(looks, place, depths, grid, options);
  result.aside_ml = volume_ml(looks, grid) - volume_ml(sure, grid);
  if (options.contrast == GlandOptions::Contrast::bright) result.failed_ml += leave_out_failed(fat, grid, sure, inner);
  result.gland = outline_gland(sure, where_gland_may_lie(inner, place, depths, grid, options), fat, grid, options);
  result.fraction.assign(inner.size(), 0);
  Mask near(sure.size());
  for (std::size_t n = 0; n < near.size(); ++n) near[n] = sure[n] || result.gland[n];
  near = dilate(near, grid, options.bridge_mm);
  for (std::size_t n = 0; n < inner.size(); ++n) {
    const float share = std::clamp<float>(fat.contrast[n] / static_cast<float>(series.pure), 0, 1);
    if (near[n] && inner[n]) result.fraction[n] = (result.gland[n] ? 1 : classes.probability[n]) * share;
  }
  return result;
}

}  // namespace supine::segmentation
