// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pipeline/report/collect.h"
#include "pipeline/report/stages.h"

namespace supine::pipeline {

/// What a person wants to know first.
struct Answer {
  std::string kind;      ///< missing, ambiguous, unexplained, nothing_missing, not_diagnosed, no_scan, no_shape
  std::string sentence;  ///< one sentence
  std::vector<std::string> facts;          ///< each a sentence that follows from a figure
  std::string next;                        ///< what to do next, in words
  std::string command;                     ///< and by command; empty when none is needed
  nlohmann::ordered_json error = nullptr;  ///< {rms_mm, mae_mm, of (whose error), noise_mm}; null without a comparison
};

/// @param stages  as stages_of() gives them: the first gap says what to run
Answer answer_of(const Case& measured, const Collected& collected, const std::vector<Stage>& stages,
                 const Places& places);

nlohmann::ordered_json answer_json(const Answer& answer);

}  // namespace supine::pipeline
