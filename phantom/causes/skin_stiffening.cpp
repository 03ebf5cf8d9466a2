// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage&, Fields& fields) {
  fields.skin_stiffening.array() += cause.values.at("exponent");
}

const bool known = add_cause_kind(
    {.name = "skin_stiffening", .draws = {{"exponent", Draw::How::log_uniform, 0.8, 4}}, .apply = apply});

}  // namespace
}  // namespace supine::phantom
