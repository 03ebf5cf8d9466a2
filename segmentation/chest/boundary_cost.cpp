// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/boundary_cost.h"

#include <algorithm>
#include <cmath>

namespace supine::segmentation {
namespace {

constexpr double unknown = 0.5;      // darkness where there is no image or no body: neither dark nor bright
constexpr double far_depth_mm = 10;  // of dark tissue that pays the whole far_weight
constexpr float forbidden = 4;       // cost of a place outside the body or next to the centre
// Border::line works on ln(grey), so that shading and suppression failures do not matter.
constexpr float least_grey = 1;  // per cent of fat: noise below it would weigh much in the logarithm
constexpr double line_half_mm = 0.75, flank_from_mm = 1.5, flank_to_mm = 4.5;  // from the middle of the line
constexpr double clear_line = 0.2;              // a line this much darker than its flanks (ln) is as clear as can be
constexpr double clear_step = 0.35;             // so is fat this much brighter than muscle
constexpr double dim_fat = 92, full_fat = 110;  // per cent of fat: below, it may be muscle; from here on it is fat
constexpr double most_step = 2;  // where suppression fails fat is far brighter, and the step says as much as a line
constexpr double line_weight = 1, step_weight = 0.5;   // fat and muscle may be equally bright: the step counts half
constexpr double neither = line_weight + step_weight;  // cost without line and step; with both clear it is 0
constexpr double even_mm = 16;                         // in front of the wall fat is even so far; chest is not
constexpr double uneven_fat = 0.2;                     // standard deviation (ln) of what is surely no fat
constexpr int least_samples = 4;                       // 3 mm: the deviation of a shorter stretch is mostly noise
constexpr double thinnest_fat_mm = 8;  // with the skin; less is not told from the skin's own dark and bright rows
constexpr double thin_fat = 0.7;       // cost of less: a clear line outweighs it, a clear step alone does not
constexpr double skin_mm = 8;          // whose bright row does not count against the fat
constexpr double first_line_mm = 5, second_line_mm = 25;  // a clear line in front within these: the wall is that one

int samples(double length_mm) { return std::max(1, static_cast<int>(std::lround(length_mm / RayProfiles::step_mm))); }

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
  /// Standard deviation over a stretch; 0 for one too short to tell.
  double deviation(int from, int to) const {
    from = std::clamp(from, 0, static_cast<int>(sums_.size()) - 1);
    to = std::clamp(to, from, static_cast<int>(sums_.size()) - 1);
    if (to - from < least_samples) return 0;
    const double mean = (sums_[to] - sums_[from]) / (to - from);
    return std::sqrt(std::max(0.0, (squares_[to] - squares_[from]) / (to - from) - mean * mean));
  }
  double sum(int from, int to) const { return sums_[to] - sums_[from]; }

 private:
  std::vector<double> sums_, squares_;
};

void step_costs(const float* greys, int count, int end, const ChestWallOptions& options, bool /*strong_steps*/,
                float* cost) {
  std::vector<float> dark(count, static_cast<float>(unknown));
  for (int i = 0; i < end; ++i)
    dark[i] = std::clamp((options.bright - greys[i]) / (options.bright - options.dark), 0.0f, 1.0f);
  const Means means(dark.data(), count);
  const int band = samples(options.band_mm);
  for (int i = 0; i < count; ++i) {
    const double beyond_mm = i + band < end ? means.sum(i + band, end) * RayProfiles::step_mm : 0;
    cost[i] = static_cast<float>(1 - means.over(i - band, i, unknown) + means.over(i, i + band, unknown) +
                                 options.far_weight * std::min(1.0, beyond_mm / far_depth_mm));
  }
}

void line_costs(const float* greys, int count, int end, const ChestWallOptions& options, bool strong_steps,
                float* cost) {
  std::vector<float> logs(count);
  for (int i = 0; i < count; ++i) logs[i] = std::log(std::max(greys[i], least_grey));
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
    const double rise = (outer - means.over(i - band, i - near + 1, logs[i])) / clear_step;
    // Muscle in front of the dark lung rises as steeply: more than a clear step counts only to what is as bright as
    // fat.
    const double fat = std::clamp((outer - std::log(dim_fat)) / (std::log(full_fat) - std::log(dim_fat)), 0.0, 1.0);
    const double step =
        std::clamp(rise, 0.0, 1.0) + (strong_steps ? fat * std::clamp(rise - 1, 0.0, most_step - 1) : 0);
    double second = 0;
    for (int j = i + from; j < std::min(i + to, end - skin); ++j) second = std::max(second, line[j]);
    const double uneven = means.deviation(i + near, std::min(i + even, end - skin));
    const double thin = i + samples(thinnest_fat_mm) > end ? thin_fat : 0;
    cost[i] = static_cast<float>(neither + thin - line_weight * line[i] - step_weight * step +
                                 options.far_weight * (second + std::min(1.0, uneven / uneven_fat)));
  }
}

}  // namespace

std::vector<float> boundary_costs(const RayProfiles& profiles, const ChestWallOptions& options, bool strong_steps) {
  std::vector<float> costs(profiles.values.size(), 0.0f);
  const bool lines = options.border == ChestWallOptions::Border::line;
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < profiles.levels(); ++k)
    for (Eigen::Index a = 0; a < profiles.angles(); ++a) {
      if (!profiles.seen(a, k)) continue;
      const std::size_t at = profiles.ray(a, k) * profiles.count;
      const int end = profiles.end[profiles.ray(a, k)];
      (lines ? line_costs : step_costs)(profiles.values.data() + at, profiles.count, end, options, strong_steps,
                                        costs.data() + at);
      for (int i = 0; i < profiles.count; ++i)
        if (i > end || profiles.radius_mm(a, k, i) < RayProfiles::nearest_mm) costs[at + i] = forbidden;
    }
  return costs;
}

}  // namespace supine::segmentation
