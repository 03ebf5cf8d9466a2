// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  if (stage.pose == "prone") fields.ln_young.array() -= cause.values.at("log_softening");
}

const bool known =
    add_cause_kind({.name = "creep", .draws = {{"log_softening", Draw::How::uniform, 0.06, 0.3}}, .apply = apply});

}  // namespace
}  // namespace supine::phantom
