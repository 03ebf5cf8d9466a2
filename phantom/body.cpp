// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/body.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "phantom/random.h"
#include "phantom/volunteers.h"

namespace supine::phantom {

Eigen::Matrix3d Body::frame() const {
  // Outward is anterior (-y), turned toward the outer side by yaw and toward the head by pitch.
  const double outer = side == "left" ? 1 : -1;
  const Eigen::Vector3d outward(outer * std::sin(yaw_rad) * std::cos(pitch_rad),
                                -std::cos(yaw_rad) * std::cos(pitch_rad), std::sin(pitch_rad));
  const Eigen::Vector3d head = (Eigen::Vector3d::UnitZ() - outward.z() * outward).normalized();
  Eigen::Matrix3d axes;
  axes << outer * head.cross(outward), head, outward;
  return axes;
}

double Body::foot_radius_at(double azimuth_rad) const {
  return foot_radius_mm *
         (1 + oval * std::cos(2 * (azimuth_rad - oval_at_rad)) + three * std::cos(3 * (azimuth_rad - three_at_rad)));
}

double Body::muscle_height(double u, double v) const {
  return -0.5 * u * u / radius_across_mm - 0.5 * v * v / radius_along_mm - skewness_per_mm2 * u * u * u;
}

Eigen::Vector3d Body::muscle_normal(double u, double v) const {
  return Eigen::Vector3d(u / radius_across_mm + 3 * skewness_per_mm2 * u * u, v / radius_along_mm, 1).normalized();
}

double Body::thickness_mm(double foot_radii) const {
  const double rest = 1 - foot_radii * foot_radii;
  return rim_mm + (rest > 0 ? (height_mm - rim_mm) * std::pow(rest, sharpness) : 0);
}

Eigen::Vector3d Body::place(const Eigen::Vector2d& disc, double share) const {
  const double foot_radii = reach * disc.norm();
  const double radius = foot_radii * foot_radius_at(std::atan2(disc.y(), disc.x()));
  const Eigen::Vector2d uv = disc.norm() > 0 ? Eigen::Vector2d(radius * disc.normalized()) : Eigen::Vector2d::Zero();
  const double thickness = thickness_mm(foot_radii), above = thickness - rim_mm;
  return Eigen::Vector3d(uv.x(), uv.y(), muscle_height(uv.x(), uv.y())) +
         share * (thickness * muscle_normal(uv.x(), uv.y()) + above * Eigen::Vector3d(lean, -drop, 0));
}

double Body::in_foot_radii(const Eigen::Vector2d& uv) const {
  return uv.norm() / foot_radius_at(std::atan2(uv.y(), uv.x()));
}

bool Body::in_gland(const Eigen::Vector3d& p) const {
  return (p - gland_centre).cwiseQuotient(gland_half_axes_mm).squaredNorm() < 1;
}

bool Body::in_tumour(const Eigen::Vector3d& p) const { return (p - tumour_centre).norm() < tumour_radius_mm; }

std::map<std::string, double> Body::numbers() const {
  return {{"foot_radius_mm", foot_radius_mm},
          {"height_mm", height_mm},
          {"rim_mm", rim_mm},
          {"sharpness", sharpness},
          {"drop", drop},
          {"lean", lean},
          {"reach", reach},
          {"radius_across_mm", radius_across_mm},
          {"radius_along_mm", radius_along_mm},
          {"yaw_rad", yaw_rad},
          {"pitch_rad", pitch_rad},
          {"tumour_radius_mm", tumour_radius_mm}};
}

namespace {

void draw_organs(Body& body, Random& random) {
  const double above = body.height_mm - body.rim_mm;
  const double width = body.foot_radius_mm * random.uniform(0.4, 0.58);
  body.gland_half_axes_mm = {width, width * random.uniform(0.85, 1.1), body.height_mm * random.uniform(0.26, 0.36)};
  const double middle = body.height_mm * random.uniform(0.46, 0.58);
  body.gland_centre = {body.foot_radius_mm * random.uniform(-0.08, 0.15) + 0.5 * body.lean * above,
                       body.foot_radius_mm * random.uniform(-0.1, 0.1) - 0.5 * body.drop * above, middle};
  body.tumour_radius_mm = random.uniform(6, 10);
  const double azimuth = random.uniform(0, 2 * std::numbers::pi), out = 0.5 * std::sqrt(random.uniform());
  body.tumour_centre =
      body.gland_centre + body.gland_half_axes_mm.cwiseProduct(Eigen::Vector3d(
                              out * std::cos(azimuth), out * std::sin(azimuth), random.uniform(-0.2, 0.3)));
}

}  // namespace

Body draw_body(std::uint64_t seed, Population population) {
  Random random(seed, "body");
  Body body;
  body.side = random.uniform() < 0.5 ? "left" : "right";
  body.foot_radius_mm = random.uniform(57, 70);
  body.oval = random.uniform(0, 0.06);
  body.oval_at_rad = random.uniform(0, std::numbers::pi);
  body.three = random.uniform(0, 0.03);
  body.three_at_rad = random.uniform(0, 2 * std::numbers::pi);
  body.reach = random.uniform(1.22, 1.3);
  body.height_mm = random.uniform(38, 50);
  body.rim_mm = random.uniform(10.5, 13.5);
  body.sharpness = random.uniform(1.15, 1.7);
  body.drop = random.uniform(0, 0.35);
  body.lean = random.uniform(-0.05, 0.2);
  body.radius_across_mm = random.uniform(125, 190);
  body.radius_along_mm = random.uniform(300, 900);
  body.skewness_per_mm2 = random.uniform(-3e-6, 3e-6);
  body.yaw_rad = random.uniform(0.2, 0.5);
  body.pitch_rad = random.uniform(-0.12, 0.12);
  const double outer = body.side == "left" ? 1 : -1;
  body.centre_mm = {outer * random.uniform(70, 100), random.uniform(-75, -45), random.uniform(-40, 40)};
  if (population == Population::volunteers) {
    const Volunteer volunteer = draw_volunteer(seed);
    body.foot_radius_mm = volunteer.foot_radius_mm;
    body.height_mm = volunteer.height_mm;
    body.breast_kpa = volunteer.breast_kpa;
    body.skin_kpa = volunteer.skin_kpa;
    body.nipple_moves_mm = volunteer.nipple_moves_mm;
    body.real_size = true;
    draw_organs(body, random);
    return body;
  }
  draw_organs(body, random);
  body.breast_kpa = random.log_uniform(0.45, 0.9);
  body.skin_kpa = random.log_uniform(11, 27);
  return body;
}

}  // namespace supine::phantom
