// SPDX-License-Identifier: AGPL-3.0-or-later
// Shapes on the breast that several causes have. q: anatomy coordinates, in foot radii.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "phantom/causes/cause.h"

namespace supine::phantom {

inline constexpr double full_turn = 2 * std::numbers::pi;

inline Eigen::Vector2d polar(double radius, double azimuth_rad) {
  return {radius * std::cos(azimuth_rad), radius * std::sin(azimuth_rad)};
}

/// A Gaussian hill that is practically nothing from twice the radius on.
inline double hill(const Eigen::Vector2d& q, const Eigen::Vector2d& centre, double radius) {
  return std::exp(-1.5 * (q - centre).squaredNorm() / (radius * radius));
}

/// The hill at the cause's place (out, azimuth_rad, radius).
inline double patch(const Cause& cause, const Eigen::Vector2d& q) {
  return hill(q, polar(cause.place.at("out"), cause.place.at("azimuth_rad")), cause.place.at("radius"));
}

/// The rows that uneven() reads.
inline const Draw unevenness{"unevenness", Draw::How::uniform, 0.0, 0.25, true},
    unevenness_at{"unevenness_at_rad", Draw::How::uniform, 0, full_turn, true};

/// 1 ± unevenness from one side of the breast to the other.
inline double uneven(const Cause& cause, const Eigen::Vector2d& q) {
  return 1 + cause.place.at("unevenness") * std::tanh(q.dot(polar(1, cause.place.at("unevenness_at_rad"))));
}

}  // namespace supine::phantom
