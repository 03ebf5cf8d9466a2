// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/landmarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "common/error.h"

namespace supine {
namespace {

std::vector<std::string> split(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> fields;
  std::size_t start = 0;
  while (true) {
    const std::size_t comma = line.find(',', start);
    fields.push_back(line.substr(start, comma - start));
    if (comma == std::string::npos) return fields;
    start = comma + 1;
  }
}

double coordinate(const std::string& field, const std::string& place) {
  std::size_t first = std::min(field.find_first_not_of(' '), field.size());
  if (field.compare(first, 1, "+") == 0 && field.compare(first + 1, 1, "-") != 0) ++first;
  double value = 0;
  const char* end = field.data() + field.size();
  const auto parsed = std::from_chars(field.data() + first, end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end || !std::isfinite(value))
    throw InputError(fmt::format("{}: '{}' is not a finite number; landmarks are name,x,y,z in mm", place, field));
  return value;
}

double sigma(const std::string& field, const std::string& place) {
  const double value = coordinate(field, place);
  if (!(value > 0))
    throw InputError(fmt::format("{}: sigma_mm is {}; it must be > 0, or leave the column out", place, value));
  return value;
}

/// Three landmarks of a body never lie in one millimetre.
void check_extent(const Landmarks& landmarks, const std::filesystem::path& file) {
  constexpr double least_mm = 3;
  if (landmarks.names.size() < 3) return;
  const double extent = (landmarks.points.colwise().maxCoeff() - landmarks.points.colwise().minCoeff()).norm();
  if (extent < least_mm)
    throw InputError(fmt::format(
        "{}: its {} landmarks lie within {:.2g} mm (diagonal of their box, bound {} mm): they look as if they were in "
        "metres; write mm",
        file.string(), landmarks.names.size(), extent, least_mm));
}

}  // namespace

Landmarks read_landmarks(const std::filesystem::path& file, const std::string& frame) {
  std::ifstream stream(file);
  if (!stream) throw InputError("landmark file " + file.string() + " cannot be read");
  std::string line;
  const std::vector<std::string> plain = {"name", "x", "y", "z"}, with_sigma = {"name", "x", "y", "z", "sigma_mm"};
  std::vector<std::string> header;
  if (std::getline(stream, line)) {
    if (line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);  // the mark that spreadsheets put before UTF-8
    header = split(line);
  }
  const bool states_sigma =
      header.size() >= with_sigma.size() && std::equal(with_sigma.begin(), with_sigma.end(), header.begin());
  if (header != plain && !states_sigma)
    throw InputError(file.string() + ":1: the header must be name,x,y,z or name,x,y,z,sigma_mm");

  Landmarks landmarks;
  std::vector<Eigen::Vector3d> points;
  std::vector<double> sigmas;
  for (int number = 2; std::getline(stream, line); ++number) {
    if (line.empty() || line == "\r") continue;
    const std::string place = fmt::format("{}:{}", file.string(), number);
    const auto fields = split(line);
    if (fields.size() != header.size())
      throw InputError(
          fmt::format("{}: {} fields, {} expected: {}", place, fields.size(), header.size(), fmt::join(header, ",")));
    if (fields[0].find_first_not_of(" \t") == std::string::npos)
      throw InputError(fmt::format("{}: the landmark has no name", place));
    if (std::find(landmarks.names.begin(), landmarks.names.end(), fields[0]) != landmarks.names.end())
      throw InputError(fmt::format("{}: landmark '{}' stands twice; each name once", place, fields[0]));
    landmarks.names.push_back(fields[0]);
    points.emplace_back(coordinate(fields[1], place), coordinate(fields[2], place), coordinate(fields[3], place));
    if (states_sigma) sigmas.push_back(sigma(fields[4], place));
    if (frame == "RAS") points.back().head<2>() *= -1;
  }
  if (points.empty())
    throw InputError(file.string() +
                     ": holds no landmark, only a header; add rows name,x,y,z in mm, or leave the file out");
  landmarks.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) landmarks.points.row(static_cast<Eigen::Index>(i)) = points[i];
  check_extent(landmarks, file);
  landmarks.sigma_mm = Eigen::Map<const Eigen::VectorXd>(sigmas.data(), static_cast<Eigen::Index>(sigmas.size()));
  return landmarks;
}

std::optional<Eigen::Index> Landmarks::row_of(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return found - names.begin();
}

void write_landmarks(const Landmarks& landmarks, const std::filesystem::path& file) {
  std::ofstream stream(file);
  const bool with_sigma = landmarks.sigma_mm.size() > 0;
  stream << (with_sigma ? "name,x,y,z,sigma_mm\n" : "name,x,y,z\n");
  for (std::size_t i = 0; i < landmarks.names.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto p = landmarks.points.row(row);
    stream << fmt::format("{},{:.3f},{:.3f},{:.3f}", landmarks.names[i], p.x(), p.y(), p.z());
    if (with_sigma) stream << fmt::format(",{}", landmarks.sigma_mm[row]);
    stream << "\n";
  }
  if (!stream.flush()) throw Error("writing " + file.string() + " failed (disk full?)");
}

}  // namespace supine
