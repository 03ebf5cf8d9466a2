// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace supine::calibration {

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double place = p * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], place - static_cast<double>(below));
}

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
  return {sum_absolute / n,           std::sqrt(sum_squares / n), percentile(absolute, 0.5),
          percentile(absolute, 0.95), percentile(absolute, 1.0),  sum / n};
}

}  // namespace supine::calibration
