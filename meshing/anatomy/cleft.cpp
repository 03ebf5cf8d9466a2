// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/cleft.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace supine::meshing {
namespace {

constexpr double bin_mm = 4;    // wider than a piece of skin, so that only a gap leaves one empty
constexpr double least_mm = 5;  // that the valley lies below both mounds
constexpr double flat_mm = 2;   // the floor is what lies this close to its lowest place

}  // namespace

double find_cleft_x(const std::vector<Eigen::Vector2d>& heights) {
  double low = INFINITY, high = -INFINITY;
  for (const auto& h : heights) {
    low = std::min(low, h.x());
    high = std::max(high, h.x());
  }
  if (heights.empty()) throw InputError("no skin, so no cleft between two breasts");
  const int n = static_cast<int>((high - low) / bin_mm) + 1;
  std::vector<double> top(n, 0), left(n), right(n);
  for (const auto& h : heights) {
    double& t = top[std::min(n - 1, static_cast<int>((h.x() - low) / bin_mm))];
    t = std::max(t, h.y());
  }
  for (int i = 0; i < n; ++i) right[i] = i > 0 ? std::max(right[i - 1], top[i]) : top[i];
  for (int i = n - 1; i >= 0; --i) left[i] = i + 1 < n ? std::max(left[i + 1], top[i]) : top[i];
  int best = 0;
  const auto depth = [&](int i) { return std::min(left[i], right[i]) - top[i]; };
  for (int i = 1; i < n; ++i)
    if (depth(i) > depth(best)) best = i;
  if (depth(best) < least_mm)
    throw InputError(fmt::format(
        "side = \"both\", but the skin shows no valley between two breasts: its deepest place across x is {:.1f} mm "
        "lower than the mounds beside it, {} mm are needed; is it one breast (side = \"left\" or \"right\")?",
        depth(best), least_mm));
  int first = best, last = best;
  while (first > 0 && top[first - 1] <= top[best] + flat_mm) --first;
  while (last + 1 < n && top[last + 1] <= top[best] + flat_mm) ++last;
  return low + bin_mm * (first + last + 1) / 2.0;
}

}  // namespace supine::meshing
