// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/tool/lineage.h"

#include <fstream>

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

bool made_from_another(const Json& figures, const fs::path& input) {
  if (!figures.is_object() || !figures.contains("provenance") || !fs::exists(input)) return false;
  const Json& made = figures["provenance"];
  if (!made.is_object() || !made.contains("inputs") || !made["inputs"].is_array()) return false;
  bool named = false;
  for (const Json& one : made["inputs"]) {
    if (text_of(one, "file") != input.filename()) continue;
    if (text_of(one, "sha256") == sha256(input)) return false;
    named = true;
  }
  return named;
}

bool made_from_another(const fs::path& product, const fs::path& input) {
  std::ifstream stream(fs::path(product).replace_extension(".json"));
  return made_from_another(Json::parse(stream, nullptr, false), input);
}

}  // namespace supine::pipeline
