// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "pipeline/case/case.h"

namespace supine::pipeline {

/// What a case's output folder holds beside shapes, under paths relative to it ("calibrated/comparison.json").
struct Collected {
  nlohmann::ordered_json figures = nlohmann::ordered_json::object();  ///< every sidecar, without its `timing`
  std::map<std::string, std::string> texts;                           ///< history.csv, sensitivity.csv, model files
  std::map<std::string, std::string> pictures;                        ///< PNG as data URI

  /// A sidecar, or null when it is not there.
  const nlohmann::ordered_json& find(const std::string& name) const;
  /// The first of @p names that is there, or null.
  const nlohmann::ordered_json& first(std::initializer_list<const char*> names) const;
};

/// How much of the pictures is taken: the rest is left out, so that the report stays small.
constexpr std::uintmax_t most_picture_bytes = 5u << 20;

/// Reads what the tools write for @p measured into @p out.
/// @throws InputError  naming the file: not JSON, not an object
Collected collect(const Case& measured, const std::filesystem::path& case_folder, const std::filesystem::path& out);

}  // namespace supine::pipeline
