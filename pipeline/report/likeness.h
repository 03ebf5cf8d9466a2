// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace supine::pipeline {

/// How alike the marks of the effects are on the fitted scan points of a diagnosis.vtp: {effects, cosine}, cosine[i][j]
/// of the arrays shape_<effect>_mm. Effects that move nothing are left out; null when the file is not there.
/// @throws InputError  the file cannot be read
nlohmann::ordered_json likeness_json(const std::filesystem::path& diagnosis_vtp);

}  // namespace supine::pipeline
