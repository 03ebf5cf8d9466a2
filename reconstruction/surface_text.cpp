// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/surface_text.h"

#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

#include "common/error.h"

namespace supine::reconstruction {
namespace {

std::vector<std::string> words(std::string_view line) {
  std::vector<std::string> result;
  std::string word;
  for (const char c : line) {
    if (std::strchr(" \t\r\n=:,;\"", c) != nullptr) {
      if (!word.empty()) result.push_back(std::move(word));
      word.clear();
    } else {
      word += c;
    }
  }
  if (!word.empty()) result.push_back(std::move(word));
  return result;
}

std::ifstream open(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(fmt::format("{}: cannot be read", file.string()));
  return in;
}

void declare_frame(const std::string& frame, const std::filesystem::path& file, Declaration& declaration) {
  if (frame != "LPS" && frame != "RAS")
    throw InputError(
        fmt::format("{}: declares the frame \"{}\"; only LPS and RAS are understood", file.string(), frame));
  if (declaration.frame && *declaration.frame != frame)
    throw InputError(fmt::format("{}: declares both the frame {} and {}; keep the true one", file.string(),
                                 *declaration.frame, frame));
  declaration.frame = frame;
}

}  // namespace

std::vector<std::string> parted_by_blanks(const std::string& line) {
  std::istringstream in(line);
  return {std::istream_iterator<std::string>(in), {}};
}

Eigen::RowVector3d read_coordinates(const std::vector<std::string>& words, const std::filesystem::path& file,
                                    long long line) {
  Eigen::RowVector3d place;
  for (std::size_t i = 1; i <= 3; ++i) {
    double& value = place[static_cast<Eigen::Index>(i - 1)] = std::nan("");
    const std::string word = i < words.size() ? words[i] : "";
    const char *begin = word.data() + (word.starts_with('+') ? 1 : 0), *end = word.data() + word.size();
    const auto parsed = std::from_chars(begin, end, value);
    if (parsed.ec == std::errc() && parsed.ptr == end && std::isfinite(value)) continue;
    throw InputError(fmt::format("{}: line {}: a vertex needs three finite numbers, and \"{}\" is none{}",
                                 file.string(), line, word,
                                 word.find(',') == std::string::npos ? "" : "; decimals are written with a point"));
  }
  return place;
}

void read_declaration(std::string_view comment, const std::filesystem::path& file, Declaration& declaration) {
  const std::vector<std::string> w = words(comment);
  for (std::size_t i = 0; i + 1 < w.size(); ++i) {
    const bool slicer = w[i] == "SPACE" && (w[i + 1] == "LPS" || w[i + 1] == "RAS");  // how 3D Slicer says it
    if (w[i] == "frame" || slicer) {
      declare_frame(w[i + 1], file, declaration);
    } else if (w[i] == "unit") {
      if (w[i + 1] != "mm")
        throw InputError(fmt::format("{}: declares the unit \"{}\"; convert it to mm", file.string(), w[i + 1]));
      declaration.unit = w[i + 1];
    }
  }
}

Declaration inspect_stl(const std::filesystem::path& file) {
  std::ifstream in = open(file);
  char head[84] = {};
  in.read(head, sizeof head);
  const std::streamsize got = in.gcount();
  const auto size = static_cast<std::uintmax_t>(std::filesystem::file_size(file));
  Declaration declaration;
  if (got == sizeof head) {
    std::uint32_t count = 0;
    std::memcpy(&count, head + 80, sizeof count);
    if (size == 84 + 50 * static_cast<std::uintmax_t>(count)) {
      read_declaration(std::string_view(head, strnlen(head, 80)), file, declaration);
      return declaration;
    }
    if (std::strncmp(head, "solid", 5) != 0)
      throw InputError(fmt::format("{}: cut short or not an STL file: {} bytes, its count of {} triangles needs {}",
                                   file.string(), size, count, 84 + 50 * static_cast<std::uintmax_t>(count)));
  }
  if (got < 5 || std::strncmp(head, "solid", 5) != 0)
    throw InputError(fmt::format("{}: not an STL file (neither \"solid\" nor a binary header)", file.string()));
  in.clear();
  in.seekg(0);
  std::string line, last;
  std::getline(in, line);
  read_declaration(line, file, declaration);
  for (long long row = 2; std::getline(in, line); ++row) {
    const std::vector<std::string> w = parted_by_blanks(line);
    if (w.empty()) continue;
    last = line;
    if (w[0] == "vertex") read_coordinates(w, file, row);
  }
  const std::vector<std::string> w = words(last);
  if (w.empty() || w[0] != "endsolid")
    throw InputError(fmt::format("{}: cut short: an STL text ends with \"endsolid\"", file.string()));
  return declaration;
}

}  // namespace supine::reconstruction
