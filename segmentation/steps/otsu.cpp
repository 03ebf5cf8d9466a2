// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/otsu.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/error.h"

namespace supine::segmentation {
namespace {

constexpr int bins = 512;

/// Counts and sums of the bins before each bin, for the variance of any run of bins in O(1).
struct Histogram {
  double lowest = 0, width = 0;
  std::array<double, bins + 1> count{}, sum{};

  explicit Histogram(std::span<const float> values) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    lowest = *low;
    width = (static_cast<double>(*high) - *low) / bins;
    for (const float v : values) {
      const int bin = std::clamp(static_cast<int>((v - lowest) / width), 0, bins - 1);
      count[bin + 1] += 1;
      sum[bin + 1] += v - lowest;
    }
    for (int b = 0; b < bins; ++b) {
      count[b + 1] += count[b];
      sum[b + 1] += sum[b];
    }
  }
  /// Share of the variance between classes that the bins [from, to) bring: (sum of values)^2 / number.
  double between(int from, int to) const {
    const double n = count[to] - count[from], s = sum[to] - sum[from];
    return n > 0 ? s * s / n : -std::numeric_limits<double>::infinity();
  }
};

}  // namespace

std::vector<double> otsu_levels(std::span<const float> values, int classes) {
  if (classes < 2 || classes > 8) throw InputError(fmt::format("thresholds: {} classes; 2 to 8 are possible", classes));
  if (values.empty()) throw InputError("thresholds: there are no values to part");
  if (*std::min_element(values.begin(), values.end()) == *std::max_element(values.begin(), values.end()))
    throw InputError(fmt::format("thresholds: all values are {}, there is nothing to part", values.front()));
  const Histogram histogram(values);
  // best[c][b]: the largest sum of shares when the bins before b make c + 1 classes; cut[c][b]: where the last begins.
  std::vector<std::array<double, bins + 1>> best(classes);
  std::vector<std::array<int, bins + 1>> cut(classes);
  for (int b = 0; b <= bins; ++b) best[0][b] = b == 0 ? -INFINITY : histogram.between(0, b);
  for (int c = 1; c < classes; ++c)
    for (int b = 0; b <= bins; ++b) {
      best[c][b] = -INFINITY;
      for (int a = c; a < b; ++a) {
        const double value = best[c - 1][a] + histogram.between(a, b);
        if (value > best[c][b]) {
          best[c][b] = value;
          cut[c][b] = a;
        }
      }
    }
  if (std::isinf(best[classes - 1][bins]))
    throw InputError(fmt::format("thresholds: fewer distinct values than {} classes", classes));
  std::vector<double> levels(static_cast<std::size_t>(classes) - 1);
  for (int c = classes - 1, b = bins; c > 0; --c) {
    b = cut[c][b];
    levels[c - 1] = histogram.lowest + b * histogram.width;
  }
  return levels;
}

}  // namespace supine::segmentation
