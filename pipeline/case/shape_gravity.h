// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "pipeline/case/case.h"

namespace supine::pipeline {

/// Whether the sidecar of a shape says that it was computed with another gravity than the case states now; one of
/// another tool says nothing.
bool is_of_other_gravity(const nlohmann::ordered_json& sidecar, const Pose& pose);

/// Whether a shape was computed with the gravity that the case states now. supine-simulate writes it beside POSE.vtu,
/// into POSE.json; a shape without it, of another tool, is taken as it is.
/// @throws InputError  both directions, and what to do
void check_gravity(const std::filesystem::path& shape, const Pose& pose);

}  // namespace supine::pipeline
