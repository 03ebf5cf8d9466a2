// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/fat_shift.h"

#include <algorithm>
#include <cmath>

#include "segmentation/chest/sampler.h"

namespace supine::segmentation {
namespace {

constexpr std::size_t most_greys = 30'000, fewest_greys = 500;

/// Squares that remain of the grey when it is made of two fields by least squares.
class TwoFields {
 public:
  void add(const Eigen::Vector2d& fields, double grey) {
    normal_ += fields * fields.transpose();
    right_ += grey * fields;
    square_ += grey * grey;
  }
  double left() const { return square_ - right_.dot(normal_.ldlt().solve(right_)); }

 private:
  Eigen::Matrix2d normal_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right_ = Eigen::Vector2d::Zero();
  double square_ = 0;
};

/// The grey of the series without suppression around gland.
struct AroundGland {
  std::vector<Eigen::Vector3d> place;
  std::vector<float> grey;
};

AroundGland around_gland(const GreyImage& image, const std::vector<float>& share, const Mask& within) {
  constexpr float clear_share = 0.3F;
  constexpr double reach_mm = 6;
  const Grid& grid = image.grid;
  Mask gland(share.size());
  for (std::size_t n = 0; n < gland.size(); ++n) gland[n] = within[n] && share[n] > clear_share;
  const Mask near = dilate(gland, grid, reach_mm);
  std::vector<std::size_t> all;
  for (std::size_t n = 0; n < near.size(); ++n)
    if (near[n] && within[n]) all.push_back(n);
  AroundGland some;
  const std::size_t stride = std::max<std::size_t>(1, all.size() / most_greys), row = grid.size.x(),
                    slice = row * static_cast<std::size_t>(grid.size.y());
  for (std::size_t v = 0; v < all.size(); v += stride) {
    const std::size_t n = all[v];
    some.place.push_back(grid.point(Eigen::Vector3d(n % row, n % slice / row, n / slice)));
    some.grey.push_back(image.voxels[n]);
  }
  return some;
}

/// Squares that remain where the holes in the fat stand at x + @p holes and gland itself at x + @p gland.
double left_with(const AroundGland& around, const GreyImage& share, const Eigen::Vector3d& holes,
                 const Eigen::Vector3d& gland) {
  TwoFields fields;
  for (std::size_t n = 0; n < around.place.size(); ++n) {
    const float hole = sample(share, around.place[n] + holes), there = sample(share, around.place[n] + gland);
    if (!std::isnan(hole) && !std::isnan(there)) fields.add({1 - hole, there}, around.grey[n]);
  }
  return fields.left();
}

}  // namespace

std::vector<int> axes_of_slices(const Grid& grid) {
  constexpr double thick = 1.5;
  std::vector<int> axes;
  for (int a = 0; a < 3; ++a)
    if (grid.spacing_mm[a] < thick * grid.spacing_mm.minCoeff()) axes.push_back(a);
  return axes;
}

FatShift find_fat_shift(const GreyImage& image, const std::vector<float>& share, const Mask& within) {
  constexpr double least_gain = 0.08, step_mm = 0.5;
  constexpr int steps = 8, slack = 3, side = 2 * steps + 1, tries = 2 * slack + 1;  // 4 mm; holes laid anew by 1.5 mm
  const GreyImage shares{image.grid, share};
  const AroundGland around = around_gland(image, share, within);
  if (around.grey.size() < fewest_greys) return {};
  const Eigen::Matrix3d& axes = image.grid.direction;
  const auto least_of = [&](int count, const auto& shift) {
    std::vector<double> left(static_cast<std::size_t>(count));
#pragma omp parallel for schedule(dynamic)
    for (int n = 0; n < count; ++n) {
      const FatShift at = shift(n);
      left[static_cast<std::size_t>(n)] = left_with(around, shares, at.laid_mm, at.laid_mm + at.fat_mm);
    }
    const auto best = std::min_element(left.begin(), left.end());
    return std::pair(shift(static_cast<int>(best - left.begin())), *best);
  };
  const auto laid = least_of(tries * tries * tries, [&](int n) -> FatShift {
    const Eigen::Vector3d index(n % tries - slack, n / tries % tries - slack, n / (tries * tries) - slack);
    return {step_mm * axes * index, Eigen::Vector3d::Zero()};
  });
  const std::vector<int> in_plane = axes_of_slices(image.grid);
  const auto count = static_cast<int>(in_plane.size()) * side * tries;
  const auto [found, least] = least_of(count, [&](int n) -> FatShift {
    const Eigen::Vector3d along = step_mm * axes.col(in_plane[static_cast<std::size_t>(n / (side * tries))]);
    return {laid.first.laid_mm + (n / side % tries - slack) * along, (n % side - steps) * along};
  });
  return least < (1 - least_gain) * laid.second ? found : FatShift{};
}

SeriesContrast moved(const SeriesContrast& contrast, const Grid& grid, const Eigen::Vector3d& shift_mm) {
  if (shift_mm.isZero(0)) return contrast;
  SeriesContrast there = contrast;
  const GreyImage values{grid, contrast.fat.contrast};
#pragma omp parallel for schedule(static)
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        const Eigen::Vector3d from = grid.point(Eigen::Vector3d(i, j, k)) + shift_mm;
        const Eigen::Vector3i near = grid.continuous_index(from).array().round().cast<int>();
        there.usable[n] = contains_point(contrast.usable, grid, from);
        if (!there.usable[n]) continue;
        const std::size_t source = grid.index(near.x(), near.y(), near.z());
        there.fat.contrast[n] = sample(values, from);
        there.fat.deviation[n] = contrast.fat.deviation[source];
      }
  return there;
}

}  // namespace supine::segmentation
