// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pipeline/case/case.h"
#include "pipeline/tool/tool.h"

namespace supine::pipeline {

/// One model whose shapes lie in a folder: the model as given, the calibrated one, each rung of the ladder.
struct ModelState {
  std::string id;     ///< given, calibrated, rung_1 …
  std::string label;  ///< for people: "as given", "calibrated", "+ ligament"
  std::filesystem::path folder;
};

/// The states of an output folder that have shapes (a supine.vtu or another pose), in the order of the error's way
/// down.
/// @param ladder  ladder.json, or null: names the effect that each rung added
std::vector<ModelState> find_states(const std::filesystem::path& out, const nlohmann::ordered_json& ladder);

/// How much is kept for showing.
struct ShapeLimits {
  int organ_triangles = 8000;
  int muscle_triangles = 3000;
  int scan_triangles = 12000;
};

/// Everything the 3-D view shows, numbers as base64 of little-endian float32, uint32 or uint8; lengths mm, LPS:
///   body {triangles, region}, organs [{name, triangles}], muscle {points, triangles}, scans [{pose, points,
///   triangles}], prone {body, organs {name: points}, landmarks}, measured_landmarks {pose: {names, points}}, states
///   [{id, label, undeformed {body, organs, landmarks}, poses {pose: {body, organs, landmarks, distance_mm (NaN where
///   the scan does not cover the skin), area (row of the comparison's areas, 255 none), scan (row of scans),
///   scan_distance_mm}}}].
/// Null when there is no mesh.vtu. Points of a body are those of its boundary. What does not belong together (a
/// comparison of another prediction) is left out with a warning.
/// @throws InputError  a file that cannot be read
nlohmann::ordered_json shapes_json(Run& run, const Case& measured, const std::filesystem::path& out,
                                   const std::vector<ModelState>& states, const ShapeLimits& limits = {});

}  // namespace supine::pipeline
