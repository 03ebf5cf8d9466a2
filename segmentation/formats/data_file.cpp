// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/formats/data_file.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <string>

namespace supine::segmentation {
namespace {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
  return first == std::string::npos ? std::string() : text.substr(first, last - first + 1);
}

}  // namespace

std::optional<std::filesystem::path> detached_data_file(const std::filesystem::path& header) {
  constexpr int most_header_lines = 1000;
  constexpr std::array keys = {"data file", "datafile", "ElementDataFile"};
  std::ifstream stream(header, std::ios::binary);
  std::string line;
  for (int n = 0; n < most_header_lines && std::getline(stream, line) && !trimmed(line).empty(); ++n) {
    const auto colon = line.find_first_of(":=");
    if (colon == std::string::npos) continue;
    if (std::find(keys.begin(), keys.end(), trimmed(line.substr(0, colon))) == keys.end()) continue;
    const std::string name = trimmed(line.substr(colon + 1));
    std::filesystem::path file = name;
    if (file.is_relative()) file = header.parent_path() / file;
    if (std::filesystem::is_regular_file(file)) return file;
    return std::nullopt;  // LOCAL, LIST, a pattern: the reader has its say
  }
  return std::nullopt;
}

}  // namespace supine::segmentation
