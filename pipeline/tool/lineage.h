// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace supine::pipeline {

/// SHA-256 of the inputs of that name that @p product was made of, by the provenance in its sidecar (X.json beside
/// X.ext, or itself where it is JSON); in the order told, empty where none is told.
std::vector<std::string> input_hashes(const std::filesystem::path& product, const std::string& name);

/// Whether @p product was made of a file that is called as @p input and held something else than it does now. False
/// where it tells of none of that name.
bool made_from_another(const std::filesystem::path& product, const std::filesystem::path& input);

}  // namespace supine::pipeline
