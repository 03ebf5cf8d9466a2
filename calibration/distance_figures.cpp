// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/distance_figures.h"

#include <cmath>

#include "common/statistics.h"

namespace supine::calibration {

DistanceFigures figures_of(const std::vector<double>& signed_mm) {
  std::vector<double> absolute;
  double sum = 0, sum_absolute = 0, sum_squares = 0;
  for (const double d : signed_mm) {
    absolute.push_back(std::abs(d));
    sum += d;
    sum_absolute += std::abs(d);
    sum_squares += d * d;
  }
  const double n = static_cast<double>(signed_mm.size());
  return {sum_absolute / n,         std::sqrt(sum_squares / n), quantile(absolute, 0.5),
          quantile(absolute, 0.95), quantile(absolute, 1.0),    sum / n};
}

}  // namespace supine::calibration
