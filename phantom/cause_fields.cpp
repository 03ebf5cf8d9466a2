// SPDX-License-Identifier: AGPL-3.0-or-later
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>

#include "phantom/cause.h"
#include "segmentation/tissue.h"

namespace supine::phantom {
namespace {

using Fields = simulation::Fields<double>;
using Apply = std::function<void(const Cause&, const Stage&, Fields&)>;

constexpr double ring_fade_mm = 3;

Eigen::Vector2d polar(double radius, double azimuth_rad) {
  return {radius * std::cos(azimuth_rad), radius * std::sin(azimuth_rad)};
}

// A Gaussian hill that is practically nothing from twice the radius on.
double hill(const Eigen::Vector2d& q, const Eigen::Vector2d& centre, double radius) {
  return std::exp(-1.5 * (q - centre).squaredNorm() / (radius * radius));
}

double patch(const Cause& cause, const Eigen::Vector2d& q) {
  return hill(q, polar(cause.place.at("out"), cause.place.at("azimuth_rad")), cause.place.at("radius"));
}

// 1 ± unevenness from one side of the breast to the other.
double uneven(const Cause& cause, const Eigen::Vector2d& q) {
  return 1 + cause.place.at("unevenness") * std::tanh(q.dot(polar(1, cause.place.at("unevenness_at_rad"))));
}

void adhesion(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index p = 0; p < fields.interface_tangential.size(); ++p)
    fields.interface_tangential[p] *=
        std::exp(cause.values.at("log_factor")) * uneven(cause, stage.layout.interface.q.row(p).transpose());
}

void ligament(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index p = 0; p < fields.interface_normal.size(); ++p) {
    const Eigen::Vector2d uv = stage.body.foot_radius_mm * stage.layout.interface.q.row(p).transpose();
    const double azimuth = std::atan2(uv.y(), uv.x());
    const double middle = stage.body.foot_radius_at(azimuth) + cause.values.at("offset_mm") +
                          cause.place.at("wave_mm") * std::cos(2 * (azimuth - cause.place.at("wave_at_rad")));
    const double beyond = std::abs(uv.norm() - middle) - 0.5 * cause.values.at("width_mm");
    const double stiffness = cause.values.at("stiffness_kpa_per_mm") / (1 + std::exp(4 * beyond / ring_fade_mm));
    fields.interface_normal[p] += stiffness;
    fields.interface_tangential[p] += stiffness;
  }
}

void fibres(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index c = 0; c < fields.fibre_modulus.size(); ++c)
    fields.fibre_modulus[c] += cause.values.at("stiffness_kpa") * uneven(cause, stage.layout.cell_q.row(c).transpose());
}

Apply tissue(segmentation::Tissue which) {
  return [which](const Cause& cause, const Stage& stage, Fields& fields) {
    fields.ln_young += cause.values.at("log_ratio") * stage.mesh.fraction.col(static_cast<int>(which));
  };
}

void stiffness_gradient(const Cause& cause, const Stage& stage, Fields& fields) {
  // A straight line in the middle that flattens toward the rim.
  const double curve = 1e-6 + cause.place.at("curve");
  const Eigen::Vector2d slope(cause.values.at("lateral"), cause.values.at("head"));
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c) {
    const Eigen::Vector2d q = stage.layout.cell_q.row(c).transpose();
    fields.ln_young[c] += slope.norm() * std::tanh(curve * q.dot(slope.normalized())) / curve;
  }
}

void skin_prestretch(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index f = 0; f < fields.skin_prestretch.size(); ++f)
    fields.skin_prestretch[f] += cause.values.at("excess") * uneven(cause, stage.layout.skin.q.row(f).transpose());
}

void arm_traction(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose == "prone") return;
  const Eigen::Matrix3d frame = stage.body.frame();
  const Eigen::Vector3d pull =
      cause.values.at("lateral_kpa") * frame.col(0) + cause.values.at("head_kpa") * frame.col(1);
  for (Eigen::Index f = 0; f < stage.layout.skin.q.rows(); ++f)
    fields.skin_traction.segment<3>(3 * f) += patch(cause, stage.layout.skin.q.row(f).transpose()) * pull;
}

void chest_wall_motion(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose == "prone") return;
  const Eigen::Vector2d centre(cause.place.at("centre_u"), cause.place.at("centre_v"));
  for (Eigen::Index p = 0; p < fields.muscle_offset.size(); ++p) {
    const double r = (stage.layout.interface.q.row(p).transpose() - centre).norm() / cause.place.at("radius");
    if (r < 1) fields.muscle_offset[p] += cause.values.at("amplitude_mm") * 0.5 * (1 + std::cos(std::numbers::pi * r));
  }
}

void gravity_tilt(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose == "prone") return;
  const Eigen::Vector3d g = fields.gravity;
  fields.gravity = Eigen::AngleAxisd(cause.values.at("roll_rad"), Eigen::Vector3d::UnitZ()) *
                   (Eigen::AngleAxisd(cause.values.at("pitch_rad"), Eigen::Vector3d::UnitX()) * g);
}

void coil_contact(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose != "prone") return;
  const auto& skin = stage.layout.skin;
  for (Eigen::Index f = 0; f < skin.q.rows(); ++f) {
    const auto corners = stage.mesh.faces.row(skin.faces[f]);
    const Eigen::Vector3d a = stage.mesh.points.row(corners[0]), b = stage.mesh.points.row(corners[1]),
                          c = stage.mesh.points.row(corners[2]);
    fields.skin_traction.segment<3>(3 * f) -=
        cause.values.at("pressure_kpa") * patch(cause, skin.q.row(f).transpose()) * (b - a).cross(c - a).normalized();
  }
}

void scar(const Cause& cause, const Stage& stage, Fields& fields) {
  const double ratio = cause.values.at("log_ratio");
  for (Eigen::Index f = 0; f < stage.layout.skin.q.rows(); ++f)
    fields.skin_modulus[f] *= std::exp(ratio * patch(cause, stage.layout.skin.q.row(f).transpose()));
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c)
    fields.ln_young[c] += ratio * patch(cause, stage.layout.cell_q.row(c).transpose());
}

void skin_gradient(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index f = 0; f < stage.layout.skin.q.rows(); ++f)
    fields.skin_modulus[f] *= std::exp(cause.values.at("log_change") *
                                       stage.layout.skin.q.row(f).dot(polar(1, cause.place.at("azimuth_rad"))));
}

// A cause that adds one number to a whole field.
Apply everywhere(Eigen::VectorXd Fields::*field, const char* value) {
  return [field, value](const Cause& cause, const Stage&, Fields& fields) {
    (fields.*field).array() += cause.values.at(value);
  };
}

const std::map<std::string, Apply>& table() {
  static const std::map<std::string, Apply> all = {
      {"adhesion", adhesion},
      {"ligament", ligament},
      {"friction", everywhere(&Fields::interface_friction, "coefficient")},
      {"strain_stiffening", everywhere(&Fields::stiffening, "exponent")},
      {"fibre_anisotropy", fibres},
      {"incompressibility",
       [](const Cause& cause, const Stage&, Fields& fields) {
         fields.poisson.array() = 0.5 - (0.5 - fields.poisson.array()) * std::exp(-cause.values.at("log_factor"));
       }},
      {"gland_stiffness", tissue(segmentation::Tissue::gland)},
      {"tumour_stiffness", tissue(segmentation::Tissue::tumour)},
      {"stiffness_gradient", stiffness_gradient},
      {"skin_prestretch", skin_prestretch},
      {"skin_stiffening", everywhere(&Fields::skin_stiffening, "exponent")},
      {"creep",
       [](const Cause& cause, const Stage& stage, Fields& fields) {
         if (stage.pose == "prone") fields.ln_young.array() -= cause.values.at("log_softening");
       }},
      {"arm_traction", arm_traction},
      {"chest_wall_motion", chest_wall_motion},
      {"gravity_tilt", gravity_tilt},
      {"coil_contact", coil_contact},
      {"scar", scar},
      {"skin_gradient", skin_gradient}};
  return all;
}

}  // namespace

void apply_cause(const Cause& cause, const Stage& stage, Fields& fields) {
  const auto found = table().find(cause.name);
  if (found != table().end()) found->second(cause, stage, fields);
}

}  // namespace supine::phantom
