// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/ray_profiles.h"

#include <algorithm>
#include <cmath>

#include "segmentation/chest/sampler.h"

namespace supine::segmentation {

RayProfiles sample_rays(const GreyImage& image, const Mask& body, const ChestWall& wall, Eigen::ArrayXXd base_mm,
                        double from_mm, double to_mm) {
  RayProfiles profiles;
  profiles.base_mm = std::move(base_mm);
  profiles.first_mm = from_mm;
  profiles.count = static_cast<int>((to_mm - from_mm) / RayProfiles::step_mm) + 1;
  const std::size_t rays = static_cast<std::size_t>(profiles.angles() * profiles.levels());
  profiles.values.assign(rays * profiles.count, 0.0f);
  profiles.end.assign(rays, profiles.count);
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < profiles.levels(); ++k)
    for (Eigen::Index a = 0; a < profiles.angles(); ++a) {
      float* to = profiles.values.data() + profiles.ray(a, k) * profiles.count;
      const Eigen::Vector3d from = wall.centre(k), along = wall.direction(a);
      float last = 0;
      bool inside = true;
      for (int i = 0; i < profiles.count; ++i) {
        const double radius = profiles.radius_mm(a, k, i);
        const Eigen::Vector3d p = from + along * radius;
        const float grey = inside ? sample(image, p) : NAN;
        if (!std::isnan(grey) && contains_point(body, image.grid, p)) {
          last = grey;
        } else if (radius >= RayProfiles::nearest_mm && inside) {
          inside = false;
          profiles.end[profiles.ray(a, k)] = i;
        }
        to[i] = last;
      }
    }
  return profiles;
}

void blur_profiles(RayProfiles& profiles, int angles, int levels) {
  const std::vector<float> before = profiles.values;
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < profiles.levels(); ++k)
    for (Eigen::Index a = 0; a < profiles.angles(); ++a)
      for (int i = 0; i < profiles.count; ++i) {
        double sum = 0, weight = 0;
        for (Eigen::Index l = std::max<Eigen::Index>(0, k - levels); l <= std::min(profiles.levels() - 1, k + levels);
             ++l)
          for (Eigen::Index b = std::max<Eigen::Index>(0, a - angles); b <= std::min(profiles.angles() - 1, a + angles);
               ++b) {
            if (i >= profiles.end[profiles.ray(b, l)]) continue;
            const double w = (1 - std::abs(static_cast<double>(l - k)) / (levels + 1)) *
                             (1 - std::abs(static_cast<double>(b - a)) / (angles + 1));
            sum += w * before[profiles.ray(b, l) * profiles.count + i];
            weight += w;
          }
        if (weight > 0) profiles.values[profiles.ray(a, k) * profiles.count + i] = static_cast<float>(sum / weight);
      }
}

}  // namespace supine::segmentation
