// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/lineage.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pipeline/tool/hash.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A text of @p json under @p key; empty where there is none.
std::string text_of(const Json& json, const char* key) {
  const auto found = json.is_object() ? json.find(key) : json.end();
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace

std::vector<std::string> input_hashes(const fs::path& product, const std::string& name) {
  std::ifstream stream(fs::path(product).replace_extension(".json"));
  const Json figures = Json::parse(stream, nullptr, false);
  const Json::json_pointer place("/provenance/inputs");
  std::vector<std::string> hashes;
  if (!figures.is_object() || !figures.contains(place)) return hashes;
  for (const Json& input : figures[place])
    if (text_of(input, "file") == name) hashes.push_back(text_of(input, "sha256"));
  return hashes;
}

bool made_from_another(const fs::path& product, const fs::path& input) {
  const auto hashes = input_hashes(product, input.filename().string());
  return !hashes.empty() && fs::exists(input) && std::find(hashes.begin(), hashes.end(), sha256(input)) == hashes.end();
}

}  // namespace supine::pipeline
