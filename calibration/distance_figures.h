// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

namespace supine::calibration {

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
