// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cmath>

#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index p = 0; p < fields.interface_tangential.size(); ++p)
    fields.interface_tangential[p] *=
        std::exp(cause.values.at("log_factor")) * uneven(cause, stage.layout.interface.q.row(p).transpose());
}

const bool known = add_cause_kind({.name = "adhesion",
                                   .draws = {{"log_factor", Draw::How::uniform, 1.5, 4}, unevenness, unevenness_at},
                                   .apply = apply,
                                   .nuisance = {{"log_factor", "log_tangential"}}});

}  // namespace
}  // namespace supine::phantom
