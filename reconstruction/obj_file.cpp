// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/obj_file.h"

#include <fmt/core.h>

#include <charconv>
#include <fstream>

#include "common/error.h"

namespace supine::reconstruction {
namespace {

/// A corner as the file writes it, and its line.
struct Corner {
  long long index, line;
};

Corner read_corner(const std::string& word, const std::filesystem::path& file, long long line) {
  const std::string text = word.substr(0, word.find('/'));
  Corner corner{0, line};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), corner.index);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError(
        fmt::format("{}: a face index in line {} is not a whole number: \"{}\"", file.string(), line, text));
  return corner;
}

/// Counted from 1; from the end of what stands above it where it is negative.
int vertex_of(const Corner& corner, long long above, long long vertices, const std::filesystem::path& file) {
  const long long vertex = corner.index > 0 ? corner.index - 1 : above + corner.index;
  if (corner.index == 0 || vertex < 0 || vertex >= vertices)
    throw InputError(fmt::format("{}: line {}: face names vertex {}, the file has {}", file.string(), corner.line,
                                 corner.index, vertices));
  return static_cast<int>(vertex);
}

/// A face may stand before its vertices.
struct Face {
  std::vector<Corner> corners;
  long long vertices_above;
};

Face read_face(const std::vector<std::string>& words, const std::filesystem::path& file, long long line,
               std::size_t vertices) {
  if (words.size() < 4)
    throw InputError(
        fmt::format("{}: line {}: a face of {} corners (at least 3)", file.string(), line, words.size() - 1));
  Face face{{}, static_cast<long long>(vertices)};
  for (std::size_t i = 1; i < words.size(); ++i) face.corners.push_back(read_corner(words[i], file, line));
  return face;
}

}  // namespace

Polygons read_obj(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(fmt::format("{}: cannot be read", file.string()));
  Polygons read;
  std::vector<Eigen::RowVector3d> points;
  std::vector<Face> faces;
  std::string line;
  for (long long row = 1; std::getline(in, line); ++row) {
    if (line.starts_with('#')) read_declaration(line, file, read.declaration);
    const std::vector<std::string> words = parted_by_blanks(line);
    if (words.empty()) continue;
    if (words[0] == "v") points.push_back(read_coordinates(words, file, row));
    if (words[0] == "f") faces.push_back(read_face(words, file, row, points.size()));
  }
  if (points.empty()) throw InputError(fmt::format("{}: has no vertices (lines that begin with v)", file.string()));
  read.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t p = 0; p < points.size(); ++p) read.points.row(static_cast<Eigen::Index>(p)) = points[p];
  for (const Face& face : faces) {
    std::vector<int>& corners = read.faces.emplace_back();
    for (const Corner& corner : face.corners)
      corners.push_back(vertex_of(corner, face.vertices_above, static_cast<long long>(points.size()), file));
  }
  return read;
}

}  // namespace supine::reconstruction
