// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/contrast_around.h"

#include <algorithm>

#include "segmentation/blur.h"

namespace supine::segmentation {
namespace {

constexpr double around_mm = 8;          // standard deviation of "around each voxel"
constexpr double single_voxel_mm = 0.8;  // noise of single voxels is smoothed by this much
constexpr float least_weight = 1e-4F;

}  // namespace

std::vector<float> smooth_contrast(const Mask& within, const std::vector<float>& contrast, const Grid& grid) {
  std::vector<float> sum(within.size(), 0), weight(within.begin(), within.end());
  for (std::size_t n = 0; n < sum.size(); ++n)
    if (within[n]) sum[n] = contrast[n];
  gaussian_blur(sum, grid, single_voxel_mm);
  gaussian_blur(weight, grid, single_voxel_mm);
  for (std::size_t n = 0; n < sum.size(); ++n) sum[n] = within[n] ? sum[n] / std::max(weight[n], least_weight) : 0;
  return sum;
}

std::vector<float> usual_contrast(const Mask& of, const std::vector<float>& contrast, const Grid& grid) {
  std::vector<float> sum(of.size(), 0), weight(of.size(), 0);
  for (std::size_t n = 0; n < of.size(); ++n)
    if (of[n]) {
      weight[n] = std::max(0.0F, contrast[n]);
      sum[n] = weight[n] * weight[n];
    }
  gaussian_blur(sum, grid, around_mm);
  gaussian_blur(weight, grid, around_mm);
  for (std::size_t n = 0; n < sum.size(); ++n) sum[n] = weight[n] > least_weight ? sum[n] / weight[n] : 0;
  return sum;
}

}  // namespace supine::segmentation
