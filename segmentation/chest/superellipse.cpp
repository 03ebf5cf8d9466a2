// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/superellipse.h"

#include <cmath>
#include <utility>
#include <vector>

namespace supine::segmentation {

double Superellipse::radius_mm(double angle_rad, double z_mm) const {
  const double depth = depth_mm + depth_slope * (z_mm - middle_z_mm);
  // Behind the centre the side goes straight back.
  const double across = std::abs(std::sin(angle_rad)) / half_width_mm,
               ahead = std::max(0.0, std::cos(angle_rad)) / std::max(10.0, depth);
  return std::pow(std::pow(across, power) + std::pow(ahead, power), -1 / power);
}

namespace {

/// Coordinate descent with halved steps from the best of the coarse ones.
Superellipse polished(Superellipse best, double sum, const std::function<double(const Superellipse&)>& cost) {
  const std::pair<double Superellipse::*, double> steps[] = {{&Superellipse::half_width_mm, 4},
                                                             {&Superellipse::depth_mm, 1.5},
                                                             {&Superellipse::depth_slope, 0.05},
                                                             {&Superellipse::power, 0.25}};
  for (double share = 1; share > 0.2;) {
    bool better = false;
    for (const auto& [member, step] : steps)
      for (const double sign : {-1.0, 1.0}) {
        Superellipse other = best;
        other.*member += sign * share * step;
        const double value = cost(other);
        if (value >= sum) continue;
        sum = value;
        best = other;
        better = true;
      }
    if (!better) share /= 2;
  }
  return best;
}

}  // namespace

Superellipse best_superellipse(const std::function<double(const Superellipse&)>& cost, double centre_depth_mm,
                               double middle_z_mm) {
  std::vector<Superellipse> candidates;
  for (const double power : {2.0, 2.5, 3.0})
    for (double half_width = 100; half_width <= 175; half_width += 7.5)
      for (double under = 3; under <= 45; under += 3)
        for (const double slope : {-0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4})
          candidates.push_back({half_width, centre_depth_mm - under, slope, power, middle_z_mm});
  std::vector<double> sums(candidates.size());
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < candidates.size(); ++n) sums[n] = cost(candidates[n]);
  std::size_t best = 0;
  for (std::size_t n = 1; n < candidates.size(); ++n)
    if (sums[n] < sums[best]) best = n;
  return polished(candidates[best], sums[best], cost);
}

}  // namespace supine::segmentation
