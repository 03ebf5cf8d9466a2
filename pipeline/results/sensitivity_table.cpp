// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/sensitivity_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <fstream>

#include "common/error.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

template <class Number>
bool parse(std::string_view text, Number& number) {
  const char* end = text.data() + text.size();
  const auto [stopped, failed] = std::from_chars(text.data(), end, number);
  return failed == std::errc{} && stopped == end;
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t comma = line.find(',');
    cells.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

std::string header_of(const std::vector<std::string>& parameters) {
  std::string line = "sample";
  for (const std::string& name : parameters) line += "," + name;
  return line + ",mae_study_mm,mae_mm,rms_mm,failed";
}

/// @return false where a cell is not what it should be
bool read_row(const std::vector<std::string_view>& cells, Eigen::Index count, std::size_t& sample,
              Eigen::VectorXd& values, calibration::RunResult& result) {
  const auto p = static_cast<std::size_t>(count);
  if (cells.size() != p + 5 || !parse(cells[0], sample)) return false;
  values.resize(count);
  for (Eigen::Index i = 0; i < count; ++i)
    if (!parse(cells[1 + static_cast<std::size_t>(i)], values[i])) return false;
  result.failed = cells[p + 4] == "1";
  if (result.failed) return cells[p + 1].empty() && cells[p + 2].empty() && cells[p + 3].empty();
  return cells[p + 4] == "0" && parse(cells[p + 1], result.mae_study_mm) && parse(cells[p + 2], result.mae_mm) &&
         parse(cells[p + 3], result.rms_mm);
}

}  // namespace

DrawRange parse_draw_range(const std::string& text) {
  DrawRange range;
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos || !parse(std::string_view(text).substr(0, colon), range.first) ||
      !parse(std::string_view(text).substr(colon + 1), range.end) || range.first >= range.end)
    throw InputError(fmt::format(
        "--draws {}: must be A:B, whole numbers with 0 <= A < B, for the draws from A on up to but without B", text));
  return range;
}

SolvedDraws solved_draws(const SensitivityRows& rows, Eigen::Index parameters) {
  SolvedDraws solved;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < rows.results.size(); ++i)
    if (!rows.results[i].failed) {
      kept.push_back(i);
      solved.mae_study_mm.push_back(rows.results[i].mae_study_mm);
    }
  solved.values.resize(static_cast<Eigen::Index>(kept.size()), parameters);
  for (std::size_t i = 0; i < kept.size(); ++i)
    solved.values.row(static_cast<Eigen::Index>(i)) = rows.values[kept[i]].transpose();
  return solved;
}

void write_sensitivity(const SensitivityRows& rows, const std::vector<std::string>& parameters, std::ostream& stream) {
  stream << header_of(parameters) << "\n";
  for (std::size_t i = 0; i < rows.results.size(); ++i) {
    const calibration::RunResult& r = rows.results[i];
    stream << rows.range.first + i + 1;
    for (const double value : rows.values[i]) stream << "," << fmt::format("{}", value);
    if (r.failed)
      stream << ",,,,1\n";
    else
      stream << fmt::format(",{},{},{},0\n", r.mae_study_mm, r.mae_mm, r.rms_mm);
  }
  if (!stream.flush()) throw InputError("writing the draws failed; check the free space on the disk");
}

SensitivityRows read_sensitivity(const fs::path& file, const std::vector<std::string>& parameters) {
  std::ifstream stream(file, std::ios::binary);
  std::string line;
  if (!std::getline(stream, line)) throw InputError(fmt::format("{} cannot be read or is empty", file.string()));
  if (line != header_of(parameters))
    throw InputError(fmt::format("{}:1: the columns are not those of this model's free parameters ({}): {}",
                                 file.string(), fmt::join(parameters, ", "), line.substr(0, 200)));
  SensitivityRows rows;
  const auto count = static_cast<Eigen::Index>(parameters.size());
  while (std::getline(stream, line)) {
    std::size_t sample = 0;
    Eigen::VectorXd values;
    calibration::RunResult result;
    const bool whole = read_row(cells_of(line), count, sample, values, result) && sample > 0;
    if (whole && rows.results.empty()) rows.range.first = rows.range.end = sample - 1;
    if (!whole || sample != rows.range.end + 1)
      throw InputError(fmt::format("{}:{}: not the row of the next sample: {}", file.string(), rows.results.size() + 2,
                                   line.substr(0, 200)));
    rows.values.push_back(std::move(values));
    rows.results.push_back(result);
    ++rows.range.end;
  }
  if (rows.results.empty()) throw InputError(fmt::format("{} holds no draw", file.string()));
  return rows;
}

SensitivityRows merge_sensitivity(std::vector<std::pair<fs::path, SensitivityRows>> parts,
                                  const std::vector<Eigen::VectorXd>& drawn) {
  std::sort(parts.begin(), parts.end(),
            [](const auto& a, const auto& b) { return a.second.range.first < b.second.range.first; });
  SensitivityRows all;
  for (const auto& [file, part] : parts) {
    if (part.range.first < all.range.end)
      throw InputError(fmt::format("{}: draw {} is in another part too", file.string(), part.range.first));
    if (part.range.first > all.range.end) break;
    if (part.range.end > drawn.size())
      throw InputError(fmt::format("{}: holds draws up to {} and --samples asks for {}", file.string(), part.range.end,
                                   drawn.size()));
    for (std::size_t i = 0; i < part.values.size(); ++i)
      if (part.values[i] != drawn[part.range.first + i])
        throw InputError(
            fmt::format("{}: sample {} is not what --seed and --law draw of this model: the part was made with others",
                        file.string(), part.range.first + i + 1));
    all.values.insert(all.values.end(), part.values.begin(), part.values.end());
    all.results.insert(all.results.end(), part.results.begin(), part.results.end());
    all.range.end = part.range.end;
  }
  if (all.range.end < drawn.size())
    throw InputError(fmt::format("draw {} is in no part, of {} that --samples asks for; make it with --draws {}:{}",
                                 all.range.end, drawn.size(), all.range.end, [&] {
                                   std::size_t next = drawn.size();
                                   for (const auto& [file, part] : parts)
                                     if (part.range.first > all.range.end) next = std::min(next, part.range.first);
                                   return next;
                                 }()));
  return all;
}

}  // namespace supine::pipeline
