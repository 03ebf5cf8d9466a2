// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "calibration/signed_distance.h"

namespace supine::calibration {

/// Points of a scan that stand out of their neighbours as no noise does: dirt, hair, a marker, a crossing ray. Found
/// here for comparison, fit and diagnosis alike, so that for one model and one scan all leave out the same points.
struct Outliers {
  std::vector<int> points;  ///< rows of the scan, ascending
  int over_skin = 0;        ///< how many points were looked at: those whose closest point is not on the skin's border
  double noise_mm = 0;      ///< that they were held against
};

/// Where fewer than Scan::least_points points lie over the skin none stands out.
/// @param place           #P by 3, mm; every point of the scan
/// @param distances       of these points to the model's skin
/// @param given_noise_mm  what the case says of the scanner, 1 sigma; 0 = nothing
Outliers find_outliers(const Points& place, const SignedDistances& distances, double given_noise_mm);

}  // namespace supine::calibration
