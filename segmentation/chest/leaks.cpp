// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/leaks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace supine::segmentation {
namespace {

// Of a step: most of the dark band, or of the bright one, is not what it should be. Of a line: neither line nor step to
// be seen (1.5 when nothing is).
constexpr double unclear_step = 0.8, unclear_line = 1.4;

constexpr double most_uneven_mm = 10;

/// Area that stands for one sample of the wall.
double sample_area_cm2(const ChestWall& wall, Eigen::Index a, Eigen::Index k) {
  return wall.radius_mm(a, k) * wall.step_angle_rad * wall.step_z_mm / 100;
}

/// Connected patches of a mask over the samples of the wall (levels of angles), largest first.
std::vector<Leak> patches_of(const Mask& mask, const ChestWall& wall, double least_cm2) {
  const Eigen::Index angles = wall.radius_mm.rows(), levels = wall.radius_mm.cols();
  Grid grid;
  grid.size = {static_cast<int>(angles), static_cast<int>(levels), 1};
  const Components patches = connected_components(mask, grid);
  std::vector<Leak> leaks(patches.size.size(), Leak{Eigen::Vector3d::Zero(), 0, 0});
  std::vector<Eigen::Vector3d> low(leaks.size(), Eigen::Vector3d::Constant(INFINITY)),
      high(leaks.size(), Eigen::Vector3d::Constant(-INFINITY));
  for (Eigen::Index k = 0; k < levels; ++k)
    for (Eigen::Index a = 0; a < angles; ++a) {
      const auto patch = patches.number[static_cast<std::size_t>(k * angles + a)];
      if (patch == 0) continue;
      const auto n = static_cast<std::size_t>(patch - 1);
      const double area = sample_area_cm2(wall, a, k);
      const Eigen::Vector3d p = wall.point(a, k);
      leaks[n].area_cm2 += area;
      leaks[n].middle_mm += area * p;
      low[n] = low[n].cwiseMin(p);
      high[n] = high[n].cwiseMax(p);
    }
  for (std::size_t n = 0; n < leaks.size(); ++n) {
    leaks[n].middle_mm /= leaks[n].area_cm2;
    leaks[n].size_mm = (high[n] - low[n]).maxCoeff();
  }
  std::erase_if(leaks, [least_cm2](const Leak& leak) { return leak.area_cm2 < least_cm2; });
  std::stable_sort(leaks.begin(), leaks.end(), [](const Leak& a, const Leak& b) { return a.area_cm2 > b.area_cm2; });
  return leaks;
}

}  // namespace

std::vector<Leak> find_leaks(const ChestWall& wall, double back_y_mm, double least_cm2) {
  const Eigen::Index angles = wall.radius_mm.rows(), levels = wall.radius_mm.cols();
  const double unclear = wall.border == ChestWallOptions::Border::line ? unclear_line : unclear_step;
  Mask mask(static_cast<std::size_t>(angles * levels), 0);
  for (Eigen::Index k = 0; k < levels; ++k)
    for (Eigen::Index a = 0; a < angles; ++a)
      mask[static_cast<std::size_t>(k * angles + a)] =
          wall.cost(a, k) > unclear && wall.point(a, k).y() < back_y_mm;  // NaN is not
  return patches_of(mask, wall, least_cm2);
}

std::vector<Leak> find_uneven(const ChestWall& wall, double back_y_mm, double least_cm2) {
  const Eigen::Index angles = wall.radius_mm.rows(), levels = wall.radius_mm.cols();
  Mask mask(static_cast<std::size_t>(angles * levels), 0);
  for (Eigen::Index a = 0; a < angles; ++a) {
    const Eigen::Index other = angles - 1 - a;
    std::vector<double> ahead(static_cast<std::size_t>(levels));
    for (Eigen::Index k = 0; k < levels; ++k) ahead[k] = wall.radius_mm(a, k) - wall.radius_mm(other, k);
    std::vector<double> sorted = ahead;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    for (Eigen::Index k = 0; k < levels; ++k)
      mask[static_cast<std::size_t>(k * angles + a)] = ahead[k] - *middle > most_uneven_mm &&
                                                       wall.point(a, k).y() < back_y_mm &&
                                                       wall.point(other, k).y() < back_y_mm;
  }
  return patches_of(mask, wall, least_cm2);
}

std::string describe(const Leak& leak) {
  return fmt::format(
      "the muscle border may leak: the image shows no border over {:.0f} cm2 around ({:.0f}, {:.0f}, {:.0f}) mm, "
      "{:.0f} mm "
      "long; look at the overlays there",
      leak.area_cm2, leak.middle_mm.x(), leak.middle_mm.y(), leak.middle_mm.z(), leak.size_mm);
}

std::string describe_uneven(const Leak& patch) {
  return fmt::format(
      "one side of the chest wall lies more than {:.0f} mm in front of the other over {:.0f} cm2 around ({:.0f}, "
      "{:.0f}, {:.0f}) mm; look at the overlays there",
      most_uneven_mm, patch.area_cm2, patch.middle_mm.x(), patch.middle_mm.y(), patch.middle_mm.z());
}

}  // namespace supine::segmentation
