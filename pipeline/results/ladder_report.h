// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>

#include "diagnosis/ladder.h"
#include "pipeline/case/model_file.h"
#include "pipeline/tool/tool.h"

namespace supine::pipeline {

/// Keys of ladder.json, as in docs/supine-diagnose.md.
nlohmann::ordered_json ladder_figures(const diagnosis::Ladder& ladder);

/// The lines a person reads.
void say_ladder(const Run& run, const diagnosis::Ladder& ladder);

/// The model of one rung (0: the base model): @p given with the effects that were added until then at its end and the
/// fitted numbers in their places; everything else, comments too, stays.
ModelText rung_model(const diagnosis::Ladder& ladder, std::size_t rung, ModelText given);

}  // namespace supine::pipeline
