// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <map>

#include "common/error.h"
#include "warp/point_formats.h"

// 3D Slicer's markups table: comments, among them the frame, then id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,…
namespace supine::warp {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (c == ',' && !quoted)
      fields.emplace_back();
    else
      fields.back() += c;
  }
  return fields;
}

double number(const std::string& text, const std::string& place) {
  const std::size_t first = text.find_first_not_of(' ');
  double value = 0;
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data() + std::min(first, text.size()), end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end || !std::isfinite(value))
    throw InputError(fmt::format("{}: '{}' is not a finite number; x, y and z stand in columns 2 to 4", place, text));
  return value;
}

class FcsvFile : public PointFile::Content {
 public:
  explicit FcsvFile(const fs::path& file) {
    extension = ".fcsv";
    std::ifstream stream(file);
    if (!stream) throw InputError(fmt::format("{}: cannot be read", file.string()));
    for (std::string line; std::getline(stream, line);) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      lines_.push_back(line);
    }
    for (const std::string& line : lines_) read_header(line);
    if (frame.empty())
      throw InputError(fmt::format("{}: names no frame (# CoordinateSystem = LPS or RAS); save it again with 3D Slicer",
                                   file.string()));
    sign_ = sign_of_frame(file, frame);
    for (std::size_t n = 0; n < lines_.size(); ++n)
      if (!lines_[n].empty() && lines_[n][0] != '#') read_point(n, fmt::format("{}:{}", file.string(), n + 1));
    groups.push_back({file.stem().string(), "Fiducial", 0, points.rows()});
  }

  void write(const Points& places, const fs::path& file) const override {
    std::ofstream stream(file, std::ios::binary);
    for (std::size_t n = 0; n < lines_.size(); ++n) {
      const auto row = row_of_.find(n);
      stream << (row == row_of_.end() ? lines_[n] : moved(lines_[n], places.row(row->second))) << "\n";
    }
    if (!stream.flush()) throw InputError(fmt::format("{}: cannot be written", file.string()));
  }

 private:
  void read_header(const std::string& line) {
    const auto equals = line.find('=');
    if (line.rfind("# CoordinateSystem", 0) != 0 || equals == std::string::npos) return;
    frame = line.substr(std::min(line.size(), line.find_first_not_of(' ', equals + 1)));
    while (!frame.empty() && frame.back() == ' ') frame.pop_back();
  }

  void read_point(std::size_t line, const std::string& place) {
    const auto fields = fields_of(lines_[line]);
    if (fields.size() < 4)
      throw InputError(fmt::format("{}: {} fields; id,x,y,z and more expected", place, fields.size()));
    constexpr std::size_t label = 11;
    row_of_[line] = points.rows();
    add(fields.size() > label && !fields[label].empty() ? fields[label] : fields[0],
        {sign_ * number(fields[1], place), sign_ * number(fields[2], place), number(fields[3], place)});
  }

  std::string moved(const std::string& line, const Eigen::RowVector3d& place) const {
    auto fields = fields_of(line);
    fields[1] = fmt::format("{:.6f}", sign_ * place.x());
    fields[2] = fmt::format("{:.6f}", sign_ * place.y());
    fields[3] = fmt::format("{:.6f}", place.z());
    return fmt::format("{}", fmt::join(fields, ","));
  }

  std::vector<std::string> lines_;
  std::map<std::size_t, Eigen::Index> row_of_;
  double sign_ = 1;
};

}  // namespace

std::unique_ptr<PointFile::Content> read_fcsv(const fs::path& file) { return std::make_unique<FcsvFile>(file); }

}  // namespace supine::warp
