// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"
#include "phantom/causes/shapes.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  for (Eigen::Index f = 0; f < fields.skin_prestretch.size(); ++f)
    fields.skin_prestretch[f] += cause.values.at("excess") * uneven(cause, stage.layout.skin.q.row(f).transpose());
}

const bool known = add_cause_kind({.name = "skin_prestretch",
                                   .draws = {{"excess", Draw::How::uniform, 0.06, 0.2}, unevenness, unevenness_at},
                                   .apply = apply});

}  // namespace
}  // namespace supine::phantom
