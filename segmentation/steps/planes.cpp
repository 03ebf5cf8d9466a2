// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/error.h"

namespace supine::segmentation {
namespace {

constexpr double widest_share = 0.99;  // of its half width: from here on the chest counts as widest
constexpr double mound_share = 0.15;   // of the mound's depth: where it begins
constexpr double below_fold_mm = 10;   // that readers still count
constexpr double near_sternum_mm = 20, far_from_sternum_mm = 140;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The depth y at which one side of a level's chest wall stops widening; nothing where the image does not show its
/// side.
std::optional<double> side_of_chest(const ChestWall& wall, Eigen::Index k, double sign) {
  std::vector<Eigen::Vector2d> side;  // from the front to the back: distance from the middle line, y
  double widest = 0;
  for (Eigen::Index a = 0; a < wall.radius_mm.rows(); ++a) {
    const Eigen::Index ray = sign > 0 ? a : wall.radius_mm.rows() - 1 - a;
    if (sign * wall.angle(ray) <= 0 || std::isnan(wall.cost(ray, k))) continue;
    const Eigen::Vector3d p = wall.point(ray, k);
    side.emplace_back(sign * (p.x() - wall.torso.sternum_x(p.z())), p.y());
    widest = std::max(widest, side.back().x());
  }
  for (const Eigen::Vector2d& place : side)
    if (place.x() >= widest_share * widest) return place.y();
  return std::nullopt;
}

double find_mid_axillary(const ChestWall& wall) {
  std::vector<double> depths;
  for (Eigen::Index k = 0; k < wall.radius_mm.cols(); ++k)
    for (const double sign : {-1.0, 1.0})
      if (const auto y = side_of_chest(wall, k, sign)) depths.push_back(*y);
  if (depths.empty())
    throw InputError("mid_axillary: the image shows no side of the chest; put the plane by hand (mid_axillary_mm)");
  return median(depths);
}

/// Greatest depth of tissue in front of the chest wall on one side, per level; 0 where there is none.
std::vector<double> depths(const FrontSkin& front, const ChestWall& wall, double sign) {
  std::vector<double> result(wall.radius_mm.cols(), 0);
  for (Eigen::Index k = 0; k < wall.radius_mm.cols(); ++k)
    for (Eigen::Index a = 0; a < wall.radius_mm.rows(); ++a) {
      const Eigen::Vector3d p = wall.point(a, k);
      const double aside = sign * (p.x() - wall.torso.sternum_x(p.z()));
      if (aside < near_sternum_mm || aside > far_from_sternum_mm || std::abs(wall.angle(a)) > 1.2) continue;
      const double skin = front.at(p.x(), p.z());
      if (!std::isnan(skin)) result[k] = std::max(result[k], p.y() - skin);
    }
  return result;
}

double find_fold(const FrontSkin& front, const ChestWall& wall, double sign) {
  const std::vector<double> depth = depths(front, wall, sign);
  const auto top = std::max_element(depth.begin(), depth.end());
  const double belly = *std::min_element(depth.begin(), top + 1);
  const double level = belly + mound_share * (*top - belly);
  auto k = top - depth.begin();
  while (k > 0 && depth[k - 1] >= level) --k;
  return wall.z(k) - wall.step_z_mm / 2;
}

}  // namespace

std::vector<CutPlane> find_planes(const FrontSkin& front, const ChestWall& wall, const Planes& step) {
  std::vector<CutPlane> planes;
  const auto add = [&planes](const char* name, char axis, const Planes::Plane& plane, auto find) {
    planes.push_back({name, axis, plane.at_mm ? *plane.at_mm : find() + plane.offset_mm, plane.at_mm.has_value()});
  };
  const double middle_z = wall.z(wall.radius_mm.cols() / 2);
  add("sternum", 'x', step.sternum, [&] { return wall.torso.sternum_x(middle_z); });
  const bool reader = step.ends == Planes::Ends::reader;
  const auto fold = [&](double sign) {
    return reader ? std::min(find_fold(front, wall, 1), find_fold(front, wall, -1)) - below_fold_mm
                  : find_fold(front, wall, sign);
  };
  add("mid_axillary", 'y', step.mid_axillary, [&] { return reader ? half_turn_y_mm(wall) : find_mid_axillary(wall); });
  add("inframammary_left", 'z', step.inframammary, [&] { return fold(1); });
  add("inframammary_right", 'z', step.inframammary, [&] { return fold(-1); });
  add("superior", 'z', step.superior, [&] { return wall.z(wall.radius_mm.cols() - 1) - wall.step_z_mm / 2; });
  return planes;
}

double half_turn_y_mm(const ChestWall& wall) {
  constexpr Eigen::Index reach = 12;  // rays to either side that give its direction: the pectoral edge alone is steep
  std::vector<double> depths;
  for (Eigen::Index k = 0; k < wall.radius_mm.cols(); ++k)
    for (const double sign : {-1.0, 1.0})
      for (Eigen::Index a = reach; a + reach < wall.radius_mm.rows(); ++a) {
        const Eigen::Index ray = sign > 0 ? a : wall.radius_mm.rows() - 1 - a;
        if (sign * wall.angle(ray) <= 0.3 || std::isnan(wall.cost(ray, k))) continue;
        const Eigen::Vector3d way = wall.point(ray + reach, k) - wall.point(ray - reach, k);
        if (sign * way.y() < std::abs(way.x())) continue;
        depths.push_back(wall.point(ray, k).y());
        break;
      }
  return depths.empty() ? wall.centre_y_mm : median(std::move(depths));
}

PlaneMasks cut_by_planes(const Mask& body, const Grid& grid, const ChestWall& wall, const std::vector<CutPlane>& planes,
                         Planes::Side side) {
  const auto at = [&planes](const char* name) {
    return *std::find_if(planes.begin(), planes.end(), [name](const CutPlane& p) { return p.name == name; });
  };
  const CutPlane sternum = at("sternum");
  const double back = at("mid_axillary").at_mm, left_low = at("inframammary_left").at_mm,
               right_low = at("inframammary_right").at_mm, high = at("superior").at_mm;
  const double tilt = sternum.given ? 0 : wall.torso.sternum_slope, middle_z = wall.z(wall.radius_mm.cols() / 2);
  PlaneMasks masks{Mask(body.size(), 0), Mask(body.size(), 0), Mask(body.size(), 0)};
#pragma omp parallel for schedule(static)
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        if (!body[n]) continue;
        const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k));
        const bool left = p.x() >= sternum.at_mm + tilt * (p.z() - middle_z);
        (left ? masks.left : masks.right)[n] = 1;
        const bool wanted = side == Planes::Side::both || (side == Planes::Side::left) == left;
        masks.model[n] = wanted && p.y() <= back && p.z() >= (left ? left_low : right_low) && p.z() <= high;
      }
  return masks;
}

}  // namespace supine::segmentation
