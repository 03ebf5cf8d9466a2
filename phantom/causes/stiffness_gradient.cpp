// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cmath>

#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  // A straight line in the middle that flattens toward the rim.
  const double curve = 1e-6 + cause.place.at("curve");
  const Eigen::Vector2d slope(cause.values.at("lateral"), cause.values.at("head"));
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c) {
    const Eigen::Vector2d q = stage.layout.cell_q.row(c).transpose();
    fields.ln_young[c] += slope.norm() * std::tanh(curve * q.dot(slope.normalized())) / curve;
  }
}

const bool known = add_cause_kind({.name = "stiffness_gradient",
                                   .draws = {{"lateral", Draw::How::direction, 0.4, 1},
                                             {"head", Draw::How::direction, 0.4, 1},
                                             {"curve", Draw::How::uniform, 0, 0.8, true}},
                                   .apply = apply});

}  // namespace
}  // namespace supine::phantom
