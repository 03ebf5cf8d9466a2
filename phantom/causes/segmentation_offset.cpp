// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

const bool known = add_cause_kind({.name = "segmentation_offset",
                                   .draws = {{"offset_mm", Draw::How::either_sign, 0.6, 1.5}},
                                   .labels_grown_mm = [](const Cause& cause) { return -cause.values.at("offset_mm"); },
                                   .nuisance = {{"offset_mm", "imaged_skin_mm"}}});

}  // namespace
}  // namespace supine::phantom
