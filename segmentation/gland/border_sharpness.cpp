// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/border_sharpness.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "segmentation/blur.h"
#include "segmentation/gland/contrast_around.h"

namespace supine::segmentation {
namespace {

constexpr double nearby_mm = 6;           // standard deviation of "borders nearby"
constexpr double over_mm = 2;             // that a border is steep
constexpr float least_sharpness = 0.42F;  // made series: gland 0.54 to 0.8, failed suppression 0.2 to 0.3
constexpr float least_weight = 1e-6F;     // of borders; farther from any nothing is said

std::array<std::size_t, 3> strides(const Grid& grid) { return {1, grid.index(0, 1, 0), grid.index(0, 0, 1)}; }

/// Calls @p work of every voxel of the mask that is not on the image's edge.
template <class Work>
void for_each_inside(const Mask& mask, const Grid& grid, Work work) {
#pragma omp parallel for schedule(static)
  for (int k = 1; k < grid.size.z() - 1; ++k)
    for (int j = 1; j < grid.size.y() - 1; ++j)
      for (int i = 1; i < grid.size.x() - 1; ++i)
        if (const std::size_t n = grid.index(i, j, k); mask[n]) work(n);
}

/// Length of the contrast's gradient, per mm; beyond the mask the contrast goes on as it is.
std::vector<float> steepness(const Mask& inner, const std::vector<float>& contrast, const Grid& grid) {
  std::vector<float> steep(contrast.size(), 0);
  const auto stride = strides(grid);
  for_each_inside(inner, grid, [&](std::size_t n) {
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t before = n - stride[axis], after = n + stride[axis];
      const int steps = inner[before] + inner[after];
      if (steps == 0) continue;
      const float rise = contrast[inner[after] ? after : n] - contrast[inner[before] ? before : n];
      sum += std::pow(rise / (steps * grid.spacing_mm[axis]), 2);
    }
    steep[n] = static_cast<float>(std::sqrt(sum));
  });
  return steep;
}

/// The steepest of a voxel and its 26 neighbours.
float steepest_beside(std::size_t n, const std::vector<float>& steep, const std::array<std::size_t, 3>& stride) {
  float most = 0;
  const std::size_t corner = n - stride[0] - stride[1] - stride[2];
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < 3; ++i)
        most = std::max(most, steep[corner + i * stride[0] + j * stride[1] + k * stride[2]]);
  return most;
}

}  // namespace

Mask with_sharp_borders(const Mask& looks, const Mask& inner, const FatLevel& fat, const Grid& grid) {
  const std::vector<float> contrast = smooth_contrast(inner, fat.contrast, grid),
                           steep = steepness(inner, contrast, grid), usual = usual_contrast(looks, contrast, grid);
  std::vector<float> sharpness(looks.size(), 0), borders(looks.size(), 0);
  const auto stride = strides(grid);
  for_each_inside(looks, grid, [&](std::size_t n) {
    const bool is_border = std::any_of(stride.begin(), stride.end(), [&](std::size_t s) {
      return (inner[n - s] && !looks[n - s]) || (inner[n + s] && !looks[n + s]);
    });
    if (!is_border || usual[n] == 0) return;
    sharpness[n] = static_cast<float>(over_mm) * steepest_beside(n, steep, stride) / usual[n];
    borders[n] = 1;
  });
  gaussian_blur(sharpness, grid, nearby_mm);
  gaussian_blur(borders, grid, nearby_mm);
  Mask sharp = looks;
  for (std::size_t n = 0; n < sharp.size(); ++n)
    sharp[n] = looks[n] && (borders[n] <= least_weight || sharpness[n] >= least_sharpness * borders[n]);
  return sharp;
}

}  // namespace supine::segmentation
