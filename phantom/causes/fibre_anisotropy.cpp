// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index c = 0; c < fields.fibre_modulus.size(); ++c)
    fields.fibre_modulus[c] += cause.values.at("stiffness_kpa") * uneven(cause, stage.layout.cell_q.row(c).transpose());
}

const bool known =
    add_cause_kind({.name = "fibre_anisotropy",
                    .draws = {{"stiffness_kpa", Draw::How::log_uniform, 0.3, 1.5}, unevenness, unevenness_at},
                    .apply = apply});

}  // namespace
}  // namespace supine::phantom
