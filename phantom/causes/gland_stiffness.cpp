// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"
#include "segmentation/tissue.h"

namespace supine::phantom {
namespace {

void apply(const Cause& cause, const Stage& stage, Fields& fields) {
  fields.ln_young +=
      cause.values.at("log_ratio") * stage.mesh.fraction.col(static_cast<int>(segmentation::Tissue::gland));
}

const bool known = add_cause_kind({.name = "gland_stiffness",
                                   .draws = {{"log_ratio", Draw::How::uniform, 0.9, 2.3}},
                                   .apply = apply,
                                   .nuisance = {{"log_ratio", "log_gland_ratio"}}});

}  // namespace
}  // namespace supine::phantom
