// SPDX-License-Identifier: AGPL-3.0-or-later
// Skin that is thicker on one side than on the other.
#include <cmath>

#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index f = 0; f < stage.layout.skin.q.rows(); ++f)
    fields.skin_modulus[f] *= std::exp(cause.values.at("log_change") *
                                       stage.layout.skin.q.row(f).dot(polar(1, cause.place.at("azimuth_rad"))));
}

const bool known = add_cause_kind(
    {.name = "skin_gradient",
     .outside = true,
     .draws = {{"log_change", Draw::How::uniform, 0.5, 1.1}, {"azimuth_rad", Draw::How::uniform, 0, full_turn, true}},
     .apply = apply});

}  // namespace
}  // namespace supine::phantom
