// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "segmentation/chest/sampler.h"
#include "segmentation/doubt/doubt.h"

namespace supine::segmentation {
namespace {

constexpr double flank_from_mm = 2.5, flank_to_mm = 6;  // from the chest wall to either side
constexpr double widest_rad = 0.8;                      // rays farther aside meet arms and ribs
constexpr double suppressed_share = 0.62;  // muscle over fat: above, fat is suppressed (0.26 and 0.84 on one patient)
constexpr double plain_share = 0.45;       // below, it is not
constexpr std::size_t fewest = 200;

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double mean_along(const GreyImage& image, const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  double sum = 0;
  int count = 0;
  for (double r = flank_from_mm; r <= flank_to_mm; r += 0.5) {
    const float grey = sample(image, from + r * along);
    if (std::isnan(grey)) return NAN;
    sum += grey;
    ++count;
  }
  return sum / count;
}

}  // namespace

void require_kind(const Segmented& segmented) {
  const ChestWall& wall = segmented.wall;
  std::vector<double> ratios;
  for (Eigen::Index k = 0; k < wall.radius_mm.cols(); ++k)
    for (Eigen::Index a = 0; a < wall.radius_mm.rows(); ++a) {
      if (std::isnan(wall.cost(a, k)) || std::abs(wall.angle(a)) > widest_rad) continue;
      const Eigen::Vector3d at = wall.point(a, k), out = wall.direction(a);
      const double fat = mean_along(segmented.image, at, out), muscle = mean_along(segmented.image, at, -out);
      if (fat > 0 && muscle > 0) ratios.push_back(muscle / fat);
    }
  if (ratios.size() < fewest)
    throw InputError(
        fmt::format("only {} rays show tissue on both sides of the chest wall, {} are needed: no prone chest is seen",
                    ratios.size(), fewest));
  const double share = median(ratios);
  if (!segmented.fat_suppressed && share > suppressed_share)
    throw InputError(
        fmt::format("another kind of image: the muscle is {:.2f} times as bright as the fat in front of it (bound "
                    "{:.2f}), so this is not "
                    "T1 without fat suppression, or its front is its back; take the recipe for fat suppression "
                    "(fatsat_auto), or another series",
                    share, suppressed_share));
  if (segmented.fat_suppressed && share < plain_share)
    throw InputError(
        fmt::format("another kind of image: the muscle is only {:.2f} times as bright as the fat in front of it (bound "
                    "{:.2f}), so the fat "
                    "is not suppressed; take the recipe for T1 without suppression (t1_auto), or another series",
                    share, plain_share));
}

}  // namespace supine::segmentation
