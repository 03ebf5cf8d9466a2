// SPDX-License-Identifier: AGPL-3.0-or-later
// A support of the chest wall that sags: one side of the muscle gives way when the body lies on its back.
#include <cmath>

#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose == "prone") return;
  const Eigen::Vector2d side = polar(1, cause.place.at("azimuth_rad"));
  for (Eigen::Index p = 0; p < fields.muscle_offset.size(); ++p) {
    const double toward = stage.layout.interface.q.row(p).dot(side) / cause.place.at("softness");
    fields.muscle_offset[p] -= cause.values.at("sag_mm") * 0.5 * (1 + std::tanh(toward));
  }
}

const bool known = add_cause_kind({.name = "sagging_support",
                                   .outside = true,
                                   .draws = {{"sag_mm", Draw::How::uniform, 4, 9},
                                             {"azimuth_rad", Draw::How::uniform, 0, full_turn, true},
                                             {"softness", Draw::How::uniform, 0.3, 0.7, true}},
                                   .apply = apply});

}  // namespace
}  // namespace supine::phantom
