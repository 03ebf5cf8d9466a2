// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cmath>
#include <numbers>

#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose == "prone") return;
  const Eigen::Vector2d centre(cause.place.at("centre_u"), cause.place.at("centre_v"));
  for (Eigen::Index p = 0; p < fields.muscle_offset.size(); ++p) {
    const double r = (stage.layout.interface.q.row(p).transpose() - centre).norm() / cause.place.at("radius");
    if (r < 1) fields.muscle_offset[p] += cause.values.at("amplitude_mm") * 0.5 * (1 + std::cos(std::numbers::pi * r));
  }
}

const bool known = add_cause_kind({.name = "chest_wall_motion",
                                   .draws = {{"amplitude_mm", Draw::How::either_sign, 3, 8},
                                             {"centre_u", Draw::How::uniform, -0.2, 0.2, true},
                                             {"centre_v", Draw::How::uniform, -0.2, 0.2, true},
                                             {"radius", Draw::How::uniform, 0.85, 1.2, true}},
                                   .apply = apply,
                                   .nuisance = {{"amplitude_mm", "breath_mm"}}});

}  // namespace
}  // namespace supine::phantom
