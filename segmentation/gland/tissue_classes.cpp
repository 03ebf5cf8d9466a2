// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/tissue_classes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace supine::segmentation {
namespace {

constexpr int most_rounds = 12;
constexpr double settled = 1e-3;  // change of the prior
constexpr double least_prior = 0.005, most_prior = 0.95;
constexpr double most_log_odds = 8;  // a grey alone never makes sure: there are other reasons to be dark or bright

/// ln of the odds of gland by the grey alone, without the prior.
double log_odds(double contrast, double deviation, double pure) {
  const double t = contrast / deviation, u = (contrast - pure) / deviation;
  const double fat = std::exp(-t * t / 2) / (deviation * std::sqrt(2 * std::numbers::pi));
  const double mixed = (std::erfc(-t / std::numbers::sqrt2) - std::erfc(-u / std::numbers::sqrt2)) / (2 * pure);
  const double beyond = u > 0 ? 1 / pure : 0;  // brighter than pure gland is no fat either
  return std::clamp(std::log(std::max(mixed + beyond, 1e-30)) - std::log(std::max(fat, 1e-30)), -most_log_odds,
                    most_log_odds);
}

}  // namespace

GlandClasses classify_gland(const std::vector<float>& contrast, const std::vector<float>& deviation, const Mask& within,
                            const Grid& grid, double pure, double neighbourhood) {
  std::vector<std::size_t> voxels;
  for (std::size_t n = 0; n < within.size(); ++n)
    if (within[n]) voxels.push_back(n);
  GlandClasses result;
  result.probability.assign(within.size(), 0);
  std::vector<float> evidence(voxels.size()), next(voxels.size());
#pragma omp parallel for schedule(static)
  for (std::size_t v = 0; v < voxels.size(); ++v)
    evidence[v] = static_cast<float>(log_odds(contrast[voxels[v]], deviation[voxels[v]], pure));
  const std::ptrdiff_t step[3] = {1, grid.size.x(), static_cast<std::ptrdiff_t>(grid.size.x()) * grid.size.y()};
  double pull[3];
  for (int a = 0; a < 3; ++a) pull[a] = neighbourhood * grid.spacing_mm.minCoeff() / grid.spacing_mm[a];
  for (int round = 0; round < most_rounds; ++round) {
    const double prior_odds = std::log(result.prior / (1 - result.prior));
    double sum = 0;
#pragma omp parallel for schedule(static)
    for (std::size_t v = 0; v < voxels.size(); ++v) {
      const auto n = static_cast<std::ptrdiff_t>(voxels[v]);
      double odds = evidence[v] + prior_odds;
      if (round > 0)
        for (int a = 0; a < 3; ++a)
          for (const std::ptrdiff_t o : {n - step[a], n + step[a]})
            if (o >= 0 && o < static_cast<std::ptrdiff_t>(within.size()) && within[o])
              odds += pull[a] * (2 * result.probability[o] - 1);
      next[v] = static_cast<float>(1 / (1 + std::exp(-odds)));
    }
    for (std::size_t v = 0; v < voxels.size(); ++v) {
      result.probability[voxels[v]] = next[v];
      sum += next[v];
    }
    const double prior =
        std::clamp(sum / static_cast<double>(std::max<std::size_t>(1, voxels.size())), least_prior, most_prior);
    const bool still = std::abs(prior - result.prior) < settled;
    result.prior = prior;
    if (still && round > 2) break;
  }
  return result;
}

}  // namespace supine::segmentation
