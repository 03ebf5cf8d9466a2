// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose == "prone") return;
  const Eigen::Matrix3d frame = stage.body.frame();
  const Eigen::Vector3d pull =
      cause.values.at("lateral_kpa") * frame.col(0) + cause.values.at("head_kpa") * frame.col(1);
  for (Eigen::Index f = 0; f < stage.layout.skin.q.rows(); ++f)
    fields.skin_traction.segment<3>(3 * f) += patch(cause, stage.layout.skin.q.row(f).transpose()) * pull;
}

const bool known = add_cause_kind({.name = "arm_traction",
                                   .draws = {{"lateral_kpa", Draw::How::direction, 0.08, 0.25},
                                             {"head_kpa", Draw::How::direction, 0.08, 0.25},
                                             {"out", Draw::How::uniform, 0.75, 1.05, true},
                                             {"azimuth_rad", Draw::How::uniform, 0.5, 1.1, true},
                                             {"radius", Draw::How::uniform, 0.4, 0.65, true}},
                                   .apply = apply});

}  // namespace
}  // namespace supine::phantom
