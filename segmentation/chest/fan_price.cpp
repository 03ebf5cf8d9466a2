// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "segmentation/chest/fan.h"

namespace supine::segmentation {
namespace {

constexpr double unknown = 0.5;      // darkness where there is no image or no body
constexpr double far_depth_mm = 10;  // of dark tissue that pays the whole far_weight
constexpr float forbidden = 4;       // price of a place outside the body or next to the centre
// Border::line works on ln(grey), so that shading and suppression failures do not matter.
constexpr double line_half_mm = 0.75, flank_from_mm = 1.5, flank_to_mm = 4.5;
constexpr double clear_line = 0.2;     // a line this much darker than its flanks (ln) is as clear as can be
constexpr double clear_step = 0.35;    // so is fat this much brighter than muscle
constexpr double even_mm = 16;         // in front of the wall fat is even so far; chest is not
constexpr double uneven_fat = 0.2;     // standard deviation (ln) of what is surely no fat
constexpr double thinnest_fat_mm = 8;  // with the skin; less is not told from the skin's own dark and bright rows
constexpr double skin_mm = 8;          // whose bright row does not count against the fat
constexpr double first_line_mm = 5, second_line_mm = 25;  // a clear line in front within these: the wall is that one

int samples(double length_mm) { return std::max(1, static_cast<int>(std::lround(length_mm / Fan::step_mm))); }

/// Means over stretches of one ray. Beyond its ends a stretch is cut; an empty one has the value given for it.
class Means {
 public:
  Means(const float* values, int count) : sums_(static_cast<std::size_t>(count) + 1, 0), squares_(sums_) {
    for (int i = 0; i < count; ++i) {
      sums_[i + 1] = sums_[i] + values[i];
      squares_[i + 1] = squares_[i] + static_cast<double>(values[i]) * values[i];
    }
  }
  double over(int from, int to, double empty) const {
    from = std::clamp(from, 0, static_cast<int>(sums_.size()) - 1);
    to = std::clamp(to, from, static_cast<int>(sums_.size()) - 1);
    return to > from ? (sums_[to] - sums_[from]) / (to - from) : empty;
  }
  /// Standard deviation over a stretch; 0 for less than four samples.
  double deviation(int from, int to) const {
    from = std::clamp(from, 0, static_cast<int>(sums_.size()) - 1);
    to = std::clamp(to, from, static_cast<int>(sums_.size()) - 1);
    if (to - from < 4) return 0;
    const double mean = (sums_[to] - sums_[from]) / (to - from);
    return std::sqrt(std::max(0.0, (squares_[to] - squares_[from]) / (to - from) - mean * mean));
  }
  double sum(int from, int to) const { return sums_[to] - sums_[from]; }

 private:
  std::vector<double> sums_, squares_;
};

void price_steps(const float* greys, int count, int end, const ChestWallOptions& options, float* price) {
  std::vector<float> dark(count, static_cast<float>(unknown));
  for (int i = 0; i < end; ++i)
    dark[i] = std::clamp((options.bright - greys[i]) / (options.bright - options.dark), 0.0f, 1.0f);
  const Means means(dark.data(), count);
  const int band = samples(options.band_mm);
  for (int i = 0; i < count; ++i) {
    const double beyond_mm = i + band < end ? means.sum(i + band, end) * Fan::step_mm : 0;
    price[i] = static_cast<float>(1 - means.over(i - band, i, unknown) + means.over(i, i + band, unknown) +
                                  options.far_weight * std::min(1.0, beyond_mm / far_depth_mm));
  }
}

void price_lines(const float* greys, int count, int end, const ChestWallOptions& options, float* price) {
  std::vector<float> logs(count);
  for (int i = 0; i < count; ++i) logs[i] = std::log(std::max(greys[i], 1.0f));
  const Means means(logs.data(), count);
  const int half = samples(line_half_mm), near = samples(flank_from_mm), far = samples(flank_to_mm),
            band = samples(options.band_mm), even = samples(even_mm), skin = samples(skin_mm),
            from = samples(first_line_mm), to = samples(second_line_mm);
  std::vector<double> line(count, 0);
  for (int i = 0; i + far < end; ++i) {
    const double here = means.over(i - half, i + half + 1, logs[i]);
    const double flanks = std::min(means.over(i - far, i - near + 1, here), means.over(i + near, i + far + 1, here));
    line[i] = std::clamp((flanks - here) / clear_line, 0.0, 1.0);
  }
  for (int i = 0; i < count; ++i) {
    const double outer = means.over(i + near, std::min(i + band, end), logs[i]);
    const double step = std::clamp((outer - means.over(i - band, i - near + 1, logs[i])) / clear_step, 0.0, 1.0);
    double second = 0;
    for (int j = i + from; j < std::min(i + to, end - skin); ++j) second = std::max(second, line[j]);
    const double uneven = means.deviation(i + near, std::min(i + even, end - skin));
    const double thin = i + samples(thinnest_fat_mm) > end ? 0.7 : 0;
    price[i] = static_cast<float>(1.5 + thin - line[i] - 0.5 * step +
                                  options.far_weight * (second + std::min(1.0, uneven / uneven_fat)));
  }
}

}  // namespace

std::vector<float> price_fan(const Fan& fan, const ChestWallOptions& options) {
  std::vector<float> prices(fan.values.size(), 0.0f);
  const bool lines = options.border == ChestWallOptions::Border::line;
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < fan.levels(); ++k)
    for (Eigen::Index a = 0; a < fan.angles(); ++a) {
      if (!fan.seen(a, k)) continue;
      const std::size_t at = fan.ray(a, k) * fan.count;
      const int end = fan.end[fan.ray(a, k)];
      (lines ? price_lines : price_steps)(fan.values.data() + at, fan.count, end, options, prices.data() + at);
      for (int i = 0; i < fan.count; ++i)
        if (i > end || fan.radius_mm(a, k, i) < Fan::nearest_mm) prices[at + i] = forbidden;
    }
  return prices;
}

}  // namespace supine::segmentation
