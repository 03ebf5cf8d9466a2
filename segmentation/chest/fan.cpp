// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/fan.h"

#include <algorithm>
#include <cmath>

#include "segmentation/chest/sampler.h"

namespace supine::segmentation {

Fan sample_fan(const GreyImage& image, const Mask& body, const ChestWall& wall, Eigen::ArrayXXd base_mm, double from_mm,
               double to_mm) {
  Fan fan;
  fan.base_mm = std::move(base_mm);
  fan.first_mm = from_mm;
  fan.count = static_cast<int>((to_mm - from_mm) / Fan::step_mm) + 1;
  const std::size_t rays = static_cast<std::size_t>(fan.angles() * fan.levels());
  fan.values.assign(rays * fan.count, 0.0f);
  fan.end.assign(rays, fan.count);
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < fan.levels(); ++k)
    for (Eigen::Index a = 0; a < fan.angles(); ++a) {
      float* to = fan.values.data() + fan.ray(a, k) * fan.count;
      const Eigen::Vector3d from = wall.centre(k), along = wall.direction(a);
      float last = 0;
      bool inside = true;
      for (int i = 0; i < fan.count; ++i) {
        const double radius = fan.radius_mm(a, k, i);
        const Eigen::Vector3d p = from + along * radius;
        const float grey = inside ? sample(image, p) : NAN;
        if (!std::isnan(grey) && contains_point(body, image.grid, p)) {
          last = grey;
        } else if (radius >= Fan::nearest_mm && inside) {
          inside = false;
          fan.end[fan.ray(a, k)] = i;
        }
        to[i] = last;
      }
    }
  return fan;
}

void blur_fan(Fan& fan, int angles, int levels) {
  const std::vector<float> before = fan.values;
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < fan.levels(); ++k)
    for (Eigen::Index a = 0; a < fan.angles(); ++a)
      for (int i = 0; i < fan.count; ++i) {
        double sum = 0, weight = 0;
        for (Eigen::Index l = std::max<Eigen::Index>(0, k - levels); l <= std::min(fan.levels() - 1, k + levels); ++l)
          for (Eigen::Index b = std::max<Eigen::Index>(0, a - angles); b <= std::min(fan.angles() - 1, a + angles);
               ++b) {
            if (i >= fan.end[fan.ray(b, l)]) continue;
            const double w = (1 - std::abs(static_cast<double>(l - k)) / (levels + 1)) *
                             (1 - std::abs(static_cast<double>(b - a)) / (angles + 1));
            sum += w * before[fan.ray(b, l) * fan.count + i];
            weight += w;
          }
        if (weight > 0) fan.values[fan.ray(a, k) * fan.count + i] = static_cast<float>(sum / weight);
      }
}

}  // namespace supine::segmentation
