// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/provenance.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string>

extern "C" char* openblas_get_config(void);

namespace supine::pipeline {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

template <class Number>
bool parse_whole(const std::string& text, Number& number) {
  const char* end = text.data() + text.size();
  const auto [stopped, failed] = std::from_chars(text.data(), end, number);
  return failed == std::errc{} && stopped == end;
}

Json typed_value(const std::string& text) {
  long long whole = 0;
  double real = 0;
  if (parse_whole(text, whole)) return whole;
  if (parse_whole(text, real) && std::isfinite(real)) return real;
  return text;
}

Json option_value(const CLI::Option& option) {
  if (option.get_expected_max() == 0) return option.count() > 0;  // a switch
  const auto& given = option.results();
  if (given.empty()) return option.get_default_str().empty() ? Json() : typed_value(option.get_default_str());
  if (given.size() == 1) return typed_value(given.front());
  Json list = Json::array();
  for (const std::string& value : given) list.push_back(typed_value(value));
  return list;
}

/// @return null when nothing of the value is worth keeping
Json without_place(const Json& value) {
  if (value.is_array()) {
    Json list = Json::array();
    for (const Json& element : value)
      if (Json kept = without_place(element); !kept.is_null()) list.push_back(kept);
    return list;
  }
  if (!value.is_string()) return value;
  const fs::path path = value.get<std::string>();
  if (fs::is_directory(path)) return {};
  return path.has_parent_path() ? Json(path.filename().string()) : value;
}

}  // namespace

std::string version_text(std::string_view tool) {
  std::string text(tool);
  text += " ";
  text += supine_version();
  if (!supine_commit().empty()) text += " (" + std::string(supine_commit()) + ")";
  return text + "\nBLAS: " + openblas_get_config();
}

Json resolved_options(const CLI::App& app) {
  Json options = Json::object();
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_positional() ? option->get_name(true) : option->get_single_name();
    if (name == "help" || name == "version") continue;
    Json value = option_value(*option);
    if (!value.is_null()) options[name] = std::move(value);
  }
  return options;
}

Json reproducible_options(const Json& options) {
  constexpr std::array<std::string_view, 6> harmless = {"output", "threads", "json", "force", "quiet", "merge"};
  Json kept = Json::object();
  for (const auto& [name, value] : options.items()) {
    if (std::find(harmless.begin(), harmless.end(), name) != harmless.end()) continue;
    if (Json bare = without_place(value); !bare.is_null()) kept[name] = std::move(bare);
  }
  return kept;
}

}  // namespace supine::pipeline
