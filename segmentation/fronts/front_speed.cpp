// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "segmentation/blur.h"
#include "segmentation/fronts/fast_marching.h"

namespace supine::segmentation {

Image<float> speed_from_gradient(const GreyImage& image, double sigma_mm, double half_per_mm) {
  if (!(sigma_mm >= 0)) throw InputError(fmt::format("speed: sigma_mm {} must be >= 0", sigma_mm));
  if (!(half_per_mm > 0)) throw InputError(fmt::format("speed: half_per_mm {} must be > 0", half_per_mm));
  const Grid& grid = image.grid;
  std::vector<float> greys = image.voxels;
  if (sigma_mm > 0) gaussian_blur(greys, grid, sigma_mm);
  Image<float> speed{grid, std::vector<float>(greys.size())};
#pragma omp parallel for schedule(static)
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        double squared = 0;
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::Vector3i low(i, j, k), high(i, j, k);
          low[axis] = std::max(0, low[axis] - 1);
          high[axis] = std::min(grid.size[axis] - 1, high[axis] + 1);
          if (low[axis] == high[axis]) continue;
          const double rise =
              (greys[grid.index(high.x(), high.y(), high.z())] - greys[grid.index(low.x(), low.y(), low.z())]) /
              ((high[axis] - low[axis]) * grid.spacing_mm[axis]);
          squared += rise * rise;
        }
        speed.at(i, j, k) = static_cast<float>(1 / (1 + squared / (half_per_mm * half_per_mm)));
      }
  return speed;
}

Image<float> speed_from_greys(const GreyImage& image, double mean, double sd) {
  if (!(sd > 0)) throw InputError(fmt::format("speed: sd {} must be > 0", sd));
  constexpr float slowest = 1e-4f;
  Image<float> speed{image.grid, std::vector<float>(image.voxels.size())};
  for (std::size_t n = 0; n < speed.voxels.size(); ++n) {
    const double away = (image.voxels[n] - mean) / sd;
    const auto value = static_cast<float>(std::exp(-away * away / 2));
    speed.voxels[n] = value < slowest ? 0 : value;
  }
  return speed;
}

}  // namespace supine::segmentation
