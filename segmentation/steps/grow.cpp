// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/grow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace supine::segmentation {
namespace {

std::string text(const Eigen::Vector3d& p) { return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z()); }

std::size_t seed_voxel(const GreyImage& image, const Grow& step, const Mask& within, const Eigen::Vector3d& seed) {
  const Grid& grid = image.grid;
  const Eigen::Vector3i at = grid.continuous_index(seed).array().round().cast<int>();
  if (!grid.contains(at.x(), at.y(), at.z())) {
    const Eigen::Vector3d a = grid.point(Eigen::Vector3d::Zero()),
                          b = grid.point((grid.size - Eigen::Vector3i::Ones()).cast<double>());
    throw InputError(
        fmt::format("seed {} lies outside the image, which reaches from {} to {}", text(seed), text(a), text(b)));
  }
  const std::size_t n = grid.index(at.x(), at.y(), at.z());
  if (!within.empty() && !within[n])
    throw InputError(fmt::format("seed {} lies outside the mask \"{}\"", text(seed), step.within));
  if (!step.grey.contains(image.voxels[n]))
    throw InputError(fmt::format("seed {} has grey {:.4g}, outside {:.4g} to {:.4g}; move it or widen the range",
                                 text(seed), image.voxels[n], step.grey.lower, step.grey.upper));
  return n;
}

Mask allowed_voxels(const GreyImage& image, const GreyRange& range, const Mask& within) {
  Mask allowed(image.voxels.size());
  for (std::size_t n = 0; n < allowed.size(); ++n)
    allowed[n] = range.contains(image.voxels[n]) && (within.empty() || within[n]);
  return allowed;
}

/// Mean +- multiplier x sd of the greys in the mask, cut to the step's own bounds.
GreyRange confidence_range(const GreyImage& image, const Grow& step, const Mask& region) {
  double sum = 0, squares = 0, count = 0;
  for (std::size_t n = 0; n < region.size(); ++n)
    if (region[n]) {
      sum += image.voxels[n];
      squares += static_cast<double>(image.voxels[n]) * image.voxels[n];
      ++count;
    }
  const double mean = sum / count, sd = std::sqrt(std::max(0.0, squares / count - mean * mean));
  const double half = step.confidence->multiplier * sd;
  return {std::max(step.grey.lower, static_cast<float>(mean - half)),
          std::min(step.grey.upper, static_cast<float>(mean + half))};
}

Mask around_seeds(const GreyImage& image, const Grow& step, const Mask& within, const std::vector<std::size_t>& seeds) {
  Mask points(image.voxels.size(), 0);
  for (const std::size_t n : seeds) points[n] = 1;
  Mask ball = dilate(points, image.grid, step.confidence->radius_mm);
  for (std::size_t n = 0; n < ball.size(); ++n)
    ball[n] = points[n] || (ball[n] && step.grey.contains(image.voxels[n]) && (within.empty() || within[n]));
  return ball;
}

}  // namespace

GrowResult grow(const GreyImage& image, const Grow& step, const Mask& within) {
  std::vector<std::size_t> seeds;
  for (const auto& seed : step.seeds_mm) seeds.push_back(seed_voxel(image, step, within, seed));
  if (!step.confidence) return {flood(allowed_voxels(image, step.grey, within), image.grid, seeds), step.grey};
  GrowResult result{around_seeds(image, step, within, seeds), {}};
  for (int round = 0; round <= step.confidence->iterations; ++round) {
    result.range = confidence_range(image, step, result.mask);
    Mask allowed = allowed_voxels(image, result.range, within);
    for (const std::size_t n : seeds) allowed[n] = 1;
    Mask grown = flood(allowed, image.grid, seeds);
    const bool settled = grown == result.mask;
    result.mask = std::move(grown);
    if (settled) break;
  }
  return result;
}

}  // namespace supine::segmentation
