// SPDX-License-Identifier: AGPL-3.0-or-later
// A scar: a patch of skin and the tissue under it, several times stiffer.
#include <cmath>

#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  const double ratio = cause.values.at("log_ratio");
  for (Eigen::Index f = 0; f < stage.layout.skin.q.rows(); ++f)
    fields.skin_modulus[f] *= std::exp(ratio * patch(cause, stage.layout.skin.q.row(f).transpose()));
  for (Eigen::Index c = 0; c < fields.ln_young.size(); ++c)
    fields.ln_young[c] += ratio * patch(cause, stage.layout.cell_q.row(c).transpose());
}

const bool known = add_cause_kind({.name = "scar",
                                   .outside = true,
                                   .draws = {{"log_ratio", Draw::How::uniform, 1.5, 2.7},
                                             {"out", Draw::How::uniform, 0.25, 0.75, true},
                                             {"azimuth_rad", Draw::How::uniform, 0, full_turn, true},
                                             {"radius", Draw::How::uniform, 0.25, 0.4, true}},
                                   .apply = apply});

}  // namespace
}  // namespace supine::phantom
