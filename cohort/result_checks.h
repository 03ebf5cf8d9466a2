// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace supine::cohort {

// Whether the results of a case can be what this version writes. What an earlier version did not write may be missing.
// @throws InputError  naming file, key, value and bound
// @throws nlohmann::json::exception  a key that is missing or of another type

/// Unit and value of each parameter against its interval and its coordinate.
void check_calibration(const nlohmann::json& calibration, const std::filesystem::path& file);

/// Verdict, probabilities and the evidence of single effects, each told once.
void check_diagnosis(const nlohmann::json& diagnosis, const std::filesystem::path& file);

/// Errors of at least 0.
void check_comparison(const nlohmann::json& comparison, const std::filesystem::path& file);

}  // namespace supine::cohort
