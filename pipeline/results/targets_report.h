// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "calibration/expected_landmarks.h"
#include "diagnosis/targets/draws.h"
#include "diagnosis/targets/regions.h"
#include "pipeline/tool/tool.h"

namespace supine::pipeline {

/// POSE_landmarks.csv with regions: the columns of common/landmarks.h and sigma_mm, behind them half axes, axes and
/// distances to the skin (docs/supine-targets.md).
/// @throws InputError  when the file cannot be written
void write_regions(const diagnosis::TargetRegions& regions, const std::filesystem::path& file);

/// Keys as in docs/supine-targets.md.
nlohmann::ordered_json regions_figures(const diagnosis::TargetQuestion& question,
                                       const diagnosis::TargetRegions& regions);

/// The `landmarks` of a POSE_landmarks.json.
/// @throws InputError  not such a file, of another pose, or of a pose without measured landmarks
calibration::ExpectedPlaces read_expected_landmarks(const std::filesystem::path& file, const std::string& pose);

/// The `hypotheses` of a diagnosis.json.
/// @throws InputError  not such a file, or one whose probabilities are none
std::vector<diagnosis::LikelySet> read_likely_sets(const std::filesystem::path& file);

nlohmann::ordered_json draws_figures(const diagnosis::TargetQuestion& question, const diagnosis::DrawnPlaces& drawn);

void say_regions(const Run& run, const diagnosis::TargetQuestion& question, const diagnosis::TargetRegions& regions);

void say_draws(const Run& run, const diagnosis::TargetQuestion& question, const diagnosis::DrawnPlaces& drawn);

}  // namespace supine::pipeline
