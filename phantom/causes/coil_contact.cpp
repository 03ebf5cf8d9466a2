// SPDX-License-Identifier: AGPL-3.0-or-later
// A pad of the coil presses on the hanging breast: a dent in the image that gravity does not explain.
#include <Eigen/Geometry>

#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
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

const bool known = add_cause_kind({.name = "coil_contact",
                                   .outside = true,
                                   .draws = {{"pressure_kpa", Draw::How::log_uniform, 0.06, 0.2},
                                             {"out", Draw::How::uniform, 0.3, 0.75, true},
                                             {"azimuth_rad", Draw::How::uniform, 0, full_turn, true},
                                             {"radius", Draw::How::uniform, 0.3, 0.5, true}},
                                   .apply = apply});

}  // namespace
}  // namespace supine::phantom
