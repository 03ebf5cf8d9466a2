// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/segmentation/fronts/plain_march.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>

namespace supine::segmentation::testing {
namespace {

struct Plain {
  const Image<float>& speed;
  int order;
  Image<double> time;
  std::vector<char> passed, given;

  double at(Eigen::Vector3i voxel) const {
    const Grid& grid = speed.grid;
    if (!grid.contains(voxel.x(), voxel.y(), voxel.z())) return INFINITY;
    const std::size_t n = grid.index(voxel.x(), voxel.y(), voxel.z());
    return passed[n] ? time.voxels[n] : INFINITY;
  }

  /// {nearest, base, weight} per axis that the front came along, earliest first.
  std::vector<std::array<double, 3>> sides(const Eigen::Vector3i& voxel) const {
    std::vector<std::array<double, 3>> result;
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3i step = Eigen::Vector3i::Unit(a);
      const int way = at(voxel - step) < at(voxel + step) ? -1 : 1;
      const double nearest = at(voxel + way * step), second = at(voxel + 2 * way * step);
      const double weight = 1 / (speed.grid.spacing_mm[a] * speed.grid.spacing_mm[a]);
      if (std::isinf(nearest)) continue;
      if (order == 2 && second <= nearest) {
        result.push_back({nearest, (4 * nearest - second) / 3, 2.25 * weight});
      } else {
        result.push_back({nearest, nearest, weight});
      }
    }
    std::sort(result.begin(), result.end());
    return result;
  }

  double solve(const Eigen::Vector3i& voxel) const {
    auto known = sides(voxel);
    const double slowness = 1.0 / speed.at(voxel.x(), voxel.y(), voxel.z());
    for (; !known.empty(); known.pop_back()) {
      double a = 0, b = 0, c = -slowness * slowness;
      for (const auto& [nearest, base, weight] : known) {
        a += weight;
        b += weight * base;
        c += weight * base * base;
      }
      const double root = (b + std::sqrt(std::max(0.0, b * b - a * c))) / a;
      if (b * b >= a * c && root >= known.back()[0]) return root;
    }
    return INFINITY;
  }
};

}  // namespace

Image<double> plain_march(const Image<float>& speed, const std::vector<FrontSource>& sources, int order) {
  const Grid& grid = speed.grid;
  Plain march{
      speed, order, {grid, std::vector<double>(grid.count(), INFINITY)}, std::vector<char>(grid.count(), 0), {}};
  march.given = march.passed;
  std::priority_queue<std::pair<double, std::size_t>, std::vector<std::pair<double, std::size_t>>, std::greater<>> heap;
  const auto set = [&](std::size_t n, double time) {
    march.time.voxels[n] = time;
    heap.push({time, n});
  };
  for (const FrontSource& source : sources) {
    const Eigen::Vector3i at = grid.continuous_index(source.point_mm).array().round().cast<int>();
    set(grid.index(at.x(), at.y(), at.z()), source.time);
    march.given[grid.index(at.x(), at.y(), at.z())] = 1;
  }
  while (!heap.empty()) {
    const auto [time, n] = heap.top();
    heap.pop();
    if (march.passed[n] || time != march.time.voxels[n]) continue;
    march.passed[n] = 1;
    const int i = static_cast<int>(n % grid.size.x()), j = static_cast<int>(n / grid.size.x() % grid.size.y());
    const Eigen::Vector3i voxel(i, j, static_cast<int>(n / grid.size.x() / grid.size.y()));
    for (int side = 0; side < 6; ++side) {
      const Eigen::Vector3i next = voxel + (side % 2 ? 1 : -1) * Eigen::Vector3i::Unit(side / 2);
      if (!grid.contains(next.x(), next.y(), next.z()) || speed.at(next.x(), next.y(), next.z()) == 0) continue;
      const std::size_t m = grid.index(next.x(), next.y(), next.z());
      if (march.passed[m] || march.given[m]) continue;
      if (const double t = march.solve(next); t != march.time.voxels[m]) set(m, t);
    }
  }
  return march.time;
}

}  // namespace supine::segmentation::testing
