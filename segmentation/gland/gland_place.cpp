// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/gland_place.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace supine::segmentation {
namespace {

constexpr double tip_mm = 3;    // the nipple is the middle of what lies this near to the foremost voxel
constexpr double apex_mm = 25;  // in front of the nipple: there the fan begins, so that it has some width at the nipple
constexpr double near_nipple_mm = 28;  // ducts and gland come up to the skin there
constexpr double least_depth_mm = 14,
                 least_deep_share = 0.5;  // so much of a piece lies so deep, unless it reaches the nipple

/// Calls f(n, point) for every voxel of the mask.
template <class F>
void for_each(const Mask& mask, const Grid& grid, const F& f) {
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        if (mask[n]) f(n, grid.point(Eigen::Vector3d(i, j, k)));
      }
}

bool in_fan(const Fan& fan, const Eigen::Vector3d& p, double least_cosine) {
  const Eigen::Vector3d way = p - (fan.nipple_mm - apex_mm * fan.inward);
  return fan.there && way.dot(fan.inward) >= least_cosine * way.norm();
}

bool near_nipple(const Fan& fan, const Eigen::Vector3d& p) {
  return fan.there && (p - fan.nipple_mm).norm() < near_nipple_mm;
}

}  // namespace

Depths measure_depths(const GlandPlace& place, const Grid& grid) {
  Mask outside(place.body.size());
  for (std::size_t n = 0; n < outside.size(); ++n) outside[n] = !place.body[n];
  Depths depths{squared_distance_mm2(outside, grid), squared_distance_mm2(place.chest, grid)};
  for (std::vector<float>* field : {&depths.skin_mm, &depths.chest_mm})
    for (float& d : *field) d = std::sqrt(d);
  return depths;
}

std::array<Fan, 2> find_fans(const GlandPlace& place, const Grid& grid) {
  std::array<Fan, 2> fans;
  std::array<double, 2> foremost{INFINITY, INFINITY};
  std::array<Eigen::Vector3d, 2> tip{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}, middle = tip;
  std::array<double, 2> tip_voxels{}, front_voxels{};
  const auto side = [&place](const Eigen::Vector3d& p) { return p.x() > place.sternum_x_mm ? 1 : 0; };
  for_each(place.breast, grid,
           [&](std::size_t, const Eigen::Vector3d& p) { foremost[side(p)] = std::min(foremost[side(p)], p.y()); });
  for_each(place.breast, grid, [&](std::size_t, const Eigen::Vector3d& p) {
    const int s = side(p);
    if (p.y() < foremost[s] + tip_mm) {
      tip[s] += p;
      ++tip_voxels[s];
    }
    if (p.y() < place.front_y_mm) {
      middle[s] += p;
      ++front_voxels[s];
    }
  });
  for (const int s : {0, 1}) {
    if (front_voxels[s] == 0) continue;
    fans[s].there = true;
    fans[s].nipple_mm = tip[s] / tip_voxels[s];
    const Eigen::Vector3d way = middle[s] / front_voxels[s] - fans[s].nipple_mm;
    if (way.norm() > tip_mm) fans[s].inward = way.normalized();
  }
  return fans;
}

Mask where_gland_may_lie(const Mask& within, const GlandPlace& place, const Depths& depths, const Grid& grid,
                         const GlandOptions& options) {
  const std::array<Fan, 2> fans = find_fans(place, grid);
  const double least_cosine = std::cos(options.fan_deg * std::numbers::pi / 180);
  Mask may(within.size(), 0);
  for_each(within, grid, [&](std::size_t n, const Eigen::Vector3d& p) {
    const Fan& fan = fans[p.x() > place.sternum_x_mm ? 1 : 0];
    may[n] = p.y() < place.back_y_mm && in_fan(fan, p, least_cosine) &&
             (near_nipple(fan, p) || depths.skin_mm[n] > options.superficial_mm);
  });
  return may;
}

Mask where_gland_lies(const Mask& looks, const GlandPlace& place, const Depths& depths, const Grid& grid,
                      const GlandOptions& options) {
  const std::array<Fan, 2> fans = find_fans(place, grid);
  Mask lies = where_gland_may_lie(looks, place, depths, grid, options);
  const Components pieces =
      connected_components(options.bridge_mm > 0 ? dilate(lies, grid, options.bridge_mm / 2) : lies, grid);
  std::vector<double> voxels(pieces.size.size() + 1, 0), deep(voxels), at_nipple(voxels);
  for_each(lies, grid, [&](std::size_t n, const Eigen::Vector3d& p) {
    ++voxels[pieces.number[n]];
    deep[pieces.number[n]] += depths.skin_mm[n] > least_depth_mm;
    at_nipple[pieces.number[n]] += near_nipple(fans[p.x() > place.sternum_x_mm ? 1 : 0], p);
  });
  const double least = options.least_ml * 1000 / grid.voxel_volume_mm3();
  for (std::size_t n = 0; n < lies.size(); ++n) {
    const std::int32_t piece = pieces.number[n];
    lies[n] =
        lies[n] && voxels[piece] >= least && (at_nipple[piece] > 0 || deep[piece] >= least_deep_share * voxels[piece]);
  }
  return lies;
}

}  // namespace supine::segmentation
