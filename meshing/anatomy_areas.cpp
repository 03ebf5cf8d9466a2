// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "meshing/anatomy.h"
#include "meshing/anatomy/foot.h"

namespace supine::meshing {
namespace {

constexpr double nipple_area_radius = 0.25;  // in foot radii

}  // namespace

double Anatomy::foot_radius_at(double theta) const { return fourier_radius(foot_fourier, theta); }

double Anatomy::from_foot_mm(const Eigen::Vector2d& q_point) const {
  const double radius = q_point.norm() * foot_radius_mm, theta = std::atan2(q_point.y(), q_point.x());
  double value = foot_fourier[0], slope = 0;
  for (int m = 1; 2 * m < foot_fourier.size(); ++m) {
    const double c = foot_fourier[2 * m - 1], s = foot_fourier[2 * m];
    value += c * std::cos(m * theta) + s * std::sin(m * theta);
    slope += m * (s * std::cos(m * theta) - c * std::sin(m * theta));
  }
  // The curve is inclined to the circles around the centre: radial difference times the cosine of that inclination.
  return (radius - value) * value / std::hypot(value, slope);
}

std::string Anatomy::area_name(const Eigen::Vector2d& q_point) const {
  const Eigen::Vector2d nipple = nipple_point >= 0 ? Eigen::Vector2d(q.row(nipple_point)) : Eigen::Vector2d(0, 0);
  if (from_foot_mm(q_point) > 0) {
    if (std::abs(q_point.y()) > std::abs(q_point.x())) return q_point.y() > 0 ? "upper edge" : "fold";
    return q_point.x() > 0 ? "lateral edge" : "sternal edge";
  }
  const Eigen::Vector2d from_nipple = q_point - nipple;
  if (from_nipple.norm() < nipple_area_radius) return "nipple area";
  return std::string(from_nipple.y() > 0 ? "upper " : "lower ") + (from_nipple.x() > 0 ? "outer" : "inner");
}

Eigen::Vector2d Anatomy::chart(Eigen::Index point) const {
  Eigen::Vector2d place = q.row(point);
  if (breasts.empty()) return place;
  const Anatomy& own = breast_frame(breast_of(point));
  place.x() += std::abs(own.foot_centre_mm.x() - sternum_x_mm) / own.foot_radius_mm;
  if (own.side == "right") place.x() = -place.x();
  return place;
}

std::string Anatomy::area_name_of(Eigen::Index point) const {
  const Eigen::Vector2d q_point = q.row(point);
  if (is_object()) {
    const auto third = static_cast<int>(3 * thickness_mm[point] / mound_height_mm);
    return object_area_names()[std::clamp(third, 0, 2)];
  }
  if (breasts.empty()) return area_name(q_point);
  const Anatomy& own = breast_frame(breast_of(point));
  return own.side + " " + own.area_name(q_point);
}

std::vector<std::string> Anatomy::all_area_names() const {
  if (is_object()) return object_area_names();
  if (breasts.empty()) return area_names();
  std::vector<std::string> names;
  for (const Anatomy& one : breasts)
    for (const std::string& name : area_names()) names.push_back(one.side + " " + name);
  return names;
}

const std::vector<std::string>& object_area_names() {
  static const std::vector<std::string> names = {"near the support", "middle", "far end"};
  return names;
}

const std::vector<std::string>& area_names() {
  static const std::vector<std::string> names = {"nipple area",  "upper outer",  "lower outer",
                                                 "upper inner",  "lower inner",  "fold",
                                                 "sternal edge", "lateral edge", "upper edge"};
  return names;
}

}  // namespace supine::meshing
