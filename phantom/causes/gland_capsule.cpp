// SPDX-License-Identifier: AGPL-3.0-or-later
// A stiff capsule around the gland: fibrous tissue where gland ends and fat begins.
#include <cmath>

#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

// 1 on the gland's border, fading on both sides.
double shell(const Body& body, const Eigen::Vector3d& local, double thickness_mm) {
  const Eigen::Vector3d scaled = (local - body.gland_centre).cwiseQuotient(body.gland_half_axes_mm);
  const Eigen::Vector3d slope = scaled.cwiseQuotient(body.gland_half_axes_mm);
  if (slope.norm() == 0) return 0;
  const double beyond_mm = (scaled.norm() - 1) * scaled.norm() / slope.norm();
  return std::exp(-2 * beyond_mm * beyond_mm / (thickness_mm * thickness_mm));
}

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int a = 0; a < 4; ++a) middle += 0.25 * stage.mesh.points.row(stage.mesh.cells(c, a)).transpose();
    fields.ln_young[c] +=
        cause.values.at("log_ratio") * shell(stage.body, stage.body.local(middle), cause.place.at("thickness_mm"));
  }
}

const bool known = add_cause_kind(
    {.name = "gland_capsule",
     .outside = true,
     .draws = {{"log_ratio", Draw::How::uniform, 1.5, 2.7}, {"thickness_mm", Draw::How::uniform, 8, 14, true}},
     .apply = apply});

}  // namespace
}  // namespace supine::phantom
