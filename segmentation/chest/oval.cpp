// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/oval.h"

#include <cmath>
#include <utility>
#include <vector>

namespace supine::segmentation {

double Oval::radius_mm(double angle_rad, double z_mm) const {
  const double depth = depth_mm + depth_slope * (z_mm - middle_z_mm);
  // Behind the centre the side goes straight back.
  const double across = std::abs(std::sin(angle_rad)) / half_width_mm,
               ahead = std::max(0.0, std::cos(angle_rad)) / std::max(10.0, depth);
  return std::pow(std::pow(across, power) + std::pow(ahead, power), -1 / power);
}

namespace {

/// Coordinate descent with halved steps from the best of the coarse ones.
Oval polished(Oval oval, double sum, const std::function<double(const Oval&)>& price) {
  const std::pair<double Oval::*, double> steps[] = {
      {&Oval::half_width_mm, 4}, {&Oval::depth_mm, 1.5}, {&Oval::depth_slope, 0.05}, {&Oval::power, 0.25}};
  for (double share = 1; share > 0.2;) {
    bool better = false;
    for (const auto& [member, step] : steps)
      for (const double sign : {-1.0, 1.0}) {
        Oval other = oval;
        other.*member += sign * share * step;
        const double value = price(other);
        if (value >= sum) continue;
        sum = value;
        oval = other;
        better = true;
      }
    if (!better) share /= 2;
  }
  return oval;
}

}  // namespace

Oval best_oval(const std::function<double(const Oval&)>& price, double centre_depth_mm, double middle_z_mm) {
  std::vector<Oval> ovals;
  for (const double power : {2.0, 2.5, 3.0})
    for (double half_width = 100; half_width <= 175; half_width += 7.5)
      for (double under = 3; under <= 45; under += 3)
        for (const double slope : {-0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4})
          ovals.push_back({half_width, centre_depth_mm - under, slope, power, middle_z_mm});
  std::vector<double> sums(ovals.size());
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < ovals.size(); ++n) sums[n] = price(ovals[n]);
  std::size_t best = 0;
  for (std::size_t n = 1; n < ovals.size(); ++n)
    if (sums[n] < sums[best]) best = n;
  return polished(ovals[best], sums[best], price);
}

}  // namespace supine::segmentation
