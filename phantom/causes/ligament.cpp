// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cmath>

#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

constexpr double ring_fade_mm = 3;

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
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

const bool known = add_cause_kind({.name = "ligament",
                                   .draws = {{"stiffness_kpa_per_mm", Draw::How::log_uniform, 0.2, 1.2},
                                             {"offset_mm", Draw::How::uniform, -5, 5},
                                             {"width_mm", Draw::How::log_uniform, 9, 17},
                                             {"wave_mm", Draw::How::uniform, 0, 2, true},
                                             {"wave_at_rad", Draw::How::uniform, 0, full_turn, true}},
                                   .apply = apply});

}  // namespace
}  // namespace supine::phantom
