// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "segmentation/chest/chest_wall.h"
#include "segmentation/masks.h"

namespace supine::segmentation {

/// How gland is told from fat inside the breast.
struct GlandOptions {
  /// dark: gland is darker than fat (T1). bright: brighter (fat suppressed).
  enum class Contrast { dark, bright } contrast = Contrast::dark;
  std::optional<Contrast> second;  ///< the same in a second series, where there is one; none = such a series is unused
  double shading_mm = 20;          ///< the finest lattice of the shading's B-splines; > 0
  double neighbourhood = 0.3;      ///< of the Potts field; >= 0
  double skin_mm = 5;              ///< next to the outside nothing is gland: skin, half-empty voxels; > 0
  double chest_mm = 4;             ///< nor next to the chest; >= 0
  double superficial_mm = 9;       ///< to here vessels and blurred skin run: gland only near the nipple
  double fan_deg = 70;             ///< of a line from the nipple against the way to the chest; farther aside is axilla
  double bridge_mm = 4;            ///< gaps that connected gland may have; >= 0
  double least_ml = 0.3;           ///< smaller islands are not gland
  double least_share = 0.4;        ///< of the contrast that gland has around a voxel that is labelled; 0 to below 1
  double least_deviations = 2;     ///< of the fat's scatter, that a labelled voxel differs at least; >= 0
  double gap_mm = 2.5;             ///< gaps narrower than twice this are gland too, as a reader outlines it; >= 0
  double failed_share = 1.6;       ///< bright: where fat is brighter than so many times its median, suppression failed
  /// Dark: whether the scanner's shift of fat is looked for and gland put back; without, it lies where the grey does.
  bool find_fat_shift = true;
};

/// What find_gland was given besides the greys; masks of the image's grid.
struct GlandPlace {
  const Mask& body;
  const Mask& breast;  ///< the modelled part of the body without the chest
  const Mask& chest;
  double sternum_x_mm;  ///< parts left from right
  double front_y_mm;    ///< what lies in front of it hangs from the chest: the skin over the sternum
  double back_y_mm;     ///< behind it is axilla and flank
};

struct GlandResult {
  Mask gland;
  std::vector<float> fraction;  ///< of gland, 0 to 1 per voxel, 0 outside the breast; gland is where it is likely
  double fat_sd = 0;            ///< of the fat's contrast, in its own grey (0.1 = 10 %), the median over the breast
  double pure = 0;              ///< contrast of pure gland: 0.7 = 70 % darker, or brighter, than fat
  double shading_low = 1, shading_high = 1;     ///< that was taken off, relative to its median
  double failed_ml = 0;                         ///< of breast where suppression failed
  std::optional<Eigen::Vector3d> fat_shift_mm;  ///< by which fat lies aside, told from the one series (moved_fat.h)
  double aside_ml = 0;  ///< that look like gland but lie elsewhere than gland does: vessels, axilla, islands
  /// Of the second series: where the same tissue lies in it, how far fat lies aside in the first (second_series.h), its
  /// fat's scatter and its contrast of pure gland.
  struct Second {
    Eigen::Vector3d shift_mm, fat_shift_mm;
    double fat_sd, pure;
  };
  std::optional<Second> second;
};

/// Finds the gland in a breast whose fat has the grey 100, roughly.
///
/// 1. Shading: the logarithm of the fat's grey as B-splines, coarse to fine, fitted to the voxels weighted by how
///    likely they are fat; it begins with the fat under the skin, which every breast has. Beyond fat, on the side where
///    no gland is, all is fat.
/// 2. Classes with neighbourhood (classify_gland); the share of gland in each voxel is its contrast over that of pure
///    gland.
/// 3. Place: not in skin, chest or failed suppression (bright: by its level, and where borders are not sharp,
///    with_sharp_borders); inside the fan from the nipple to the chest; no small islands.
/// 4. Labelled is what a reader outlines around it (outline_gland); the share is not that of the filled gaps.
/// In one dark series whose fat the scanner moved, 2 begins with the share of gland where it is (moved_fat.h).
/// With a second series 1 is done for each by itself, and the shares they say are taken together (share_by_both); where
/// suppression failed in one of them the other speaks alone.
/// @param second  of the same body, in greys of its own, on any grid; null without options.second
/// @throws InputError  when the breast has too few voxels to fit; a second series of another body (lay_over)
GlandResult find_gland(const GreyImage& image, const GlandPlace& place, const GlandOptions& options,
                       const GreyImage* second = nullptr);

}  // namespace supine::segmentation
