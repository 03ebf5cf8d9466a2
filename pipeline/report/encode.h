// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "common/arrays.h"

namespace supine::pipeline {

/// Base64 with padding (RFC 4648), without line breaks.
std::string base64(std::span<const std::byte> bytes);

/// Arrays as base64 of little-endian numbers, row by row. Lengths keep 1e-5 mm at the size of a body.
std::string base64_floats(const Points& values);
std::string base64_values(const Eigen::VectorXd& values);
std::string base64_indices(const Triangles& values);
std::string base64_bytes(const Eigen::VectorXi& values);  ///< each 0 to 255

/// @p json on one line, fit to stand inside a <script> element whatever its strings hold: no "<", ">", "&" and no line
/// separators of JavaScript; bytes that are not UTF-8 become U+FFFD.
std::string json_for_script(const nlohmann::ordered_json& json);

/// @p text fit to stand in HTML, between tags and inside quotes.
std::string escape_html(std::string_view text);

}  // namespace supine::pipeline
