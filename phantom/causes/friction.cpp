// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage&, Fields& fields) {
  fields.interface_friction.array() += cause.values.at("coefficient");
}

const bool known =
    add_cause_kind({.name = "friction", .draws = {{"coefficient", Draw::How::uniform, 0.1, 0.5}}, .apply = apply});

}  // namespace
}  // namespace supine::phantom
