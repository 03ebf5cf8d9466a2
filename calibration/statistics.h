// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

namespace supine::calibration {

/// Value below which the share @p p of @p values lies, linear between neighbouring order statistics: of n sorted
/// values the one at place p (n − 1). NaN without values.
/// @param p  in [0, 1]
double percentile(std::vector<double> values, double p);

/// Figures of signed distances, mm. All NaN without values.
struct DistanceFigures {
  double mae_mm;  ///< mean |d|
  double rms_mm;
  double median_mm;     ///< of |d|
  double p95_mm;        ///< of |d|
  double hausdorff_mm;  ///< max |d|
  double mean_signed_mm;
};
DistanceFigures figures_of(const std::vector<double>& signed_mm);

}  // namespace supine::calibration
