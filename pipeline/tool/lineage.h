// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace supine::pipeline {

/// Whether the provenance in @p figures (of a sidecar, or of a result that is JSON itself) names an input that is
/// called as @p input and held something else than it does now. False where it names none of that name.
bool made_from_another(const nlohmann::ordered_json& figures, const std::filesystem::path& input);

/// The same of a file with a sidecar beside it (X.ext with X.json); false where there is none.
bool made_from_another(const std::filesystem::path& product, const std::filesystem::path& input);

}  // namespace supine::pipeline
