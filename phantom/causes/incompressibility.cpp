// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cmath>

#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage&, Fields& fields) {
  fields.poisson.array() = 0.5 - (0.5 - fields.poisson.array()) * std::exp(-cause.values.at("log_factor"));
}

const bool known = add_cause_kind({.name = "incompressibility",
                                   .draws = {{"log_factor", Draw::How::uniform, 1, 3}},
                                   .apply = apply,
                                   .nuisance = {{"log_factor", "log_incompressibility"}}});

}  // namespace
}  // namespace supine::phantom
