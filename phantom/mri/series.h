// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>

#include "phantom/mri/torso.h"

namespace supine::phantom {

/// Which series is made. fatsat: T1 with fat suppression. t2: T2 with fat suppression.
enum class Series { t1, fatsat, t2 };

/// What spoils it; drawn from the seed in ranges that cover clinical series at 1.5 T.
struct SeriesOptions {
  Series series = Series::t1;
  Eigen::Vector3d voxel_mm = Eigen::Vector3d::Zero();  ///< 0 = drawn: 1.1 to 1.5 across, 2 to 4 along the body
  bool suppression_fails = true;                       ///< in one or two places (fatsat, t2); false = nowhere
  std::optional<double> fat_phase_rad =
      std::nullopt;          ///< of fat against water at the echo; absent: drawn (fatsat), else 0
  bool all_fails = false;    ///< nothing is suppressed
  bool inverted = false;     ///< a negative of the series
  bool upside_down = false;  ///< y turned round
};

/// A made series and what it was made of, on one grid.
struct MadeSeries {
  segmentation::GreyImage image;   ///< magnitude, whole numbers
  segmentation::LabelImage truth;  ///< Stuff, the most frequent in each voxel
  std::vector<float> gland_share;  ///< per voxel, by finer sampling
};

/// Makes the series of a torso: greys per tissue with partial volume (2 × 2 × 3 points a voxel), fat shifted along x by
/// chemical shift and, in half of the fatsat series, out of phase with water (a dark line wherever both meet), the dark
/// fascia on the muscle, the coil's sensitivity (two loops in front of the breasts), suppression that fails near the
/// inner lower breast, ghosts of the moving chest along x, Rician noise.
MadeSeries make_series(const Torso& torso, std::uint64_t seed, const SeriesOptions& options);

}  // namespace supine::phantom
