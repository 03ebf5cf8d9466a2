// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/run_journal.h"

#include <fmt/format.h>

#include <sstream>

#include "common/error.h"

namespace supine::calibration {
namespace {

std::vector<double> listed(const Eigen::VectorXd& values) { return {values.begin(), values.end()}; }

/// "failed mae_study mae rms | value value …", each number with all its digits.
std::string line_of(const std::vector<double>& values, const RunResult& r) {
  std::string line = fmt::format("{:d} {} {} {} |", r.failed, r.mae_study_mm, r.mae_mm, r.rms_mm);
  for (const double value : values) line += fmt::format(" {}", value);
  return line + " .\n";  // the dot says that the line is whole
}

}  // namespace

RunJournal::RunJournal(const std::filesystem::path& file, const std::string& key) : file_(file) {
  read(key);
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path());
  stream_.open(file, runs_.empty() ? std::ios::binary | std::ios::trunc : std::ios::binary | std::ios::app);
  if (runs_.empty()) stream_ << key << "\n" << std::flush;
  if (!stream_) throw InputError(fmt::format("cannot write {}", file.string()));
}

void RunJournal::read(const std::string& key) {
  std::ifstream stream(file_, std::ios::binary);
  std::string line;
  if (!std::getline(stream, line) || line != key) return;
  while (std::getline(stream, line)) {
    if (!line.ends_with(" .")) continue;
    std::istringstream numbers(line.substr(0, line.size() - 2));
    RunResult result;
    std::string bar;
    if (!(numbers >> result.failed >> result.mae_study_mm >> result.mae_mm >> result.rms_mm >> bar)) continue;
    std::vector<double> values;
    for (double value; numbers >> value;) values.push_back(value);
    runs_[values] = result;
  }
}

std::optional<RunResult> RunJournal::find(const Eigen::VectorXd& values) const {
  const std::lock_guard lock(mutex_);
  const auto found = runs_.find(listed(values));
  return found == runs_.end() ? std::nullopt : std::optional(found->second);
}

void RunJournal::add(const Eigen::VectorXd& values, const RunResult& result) {
  const std::lock_guard lock(mutex_);
  runs_[listed(values)] = result;
  if (stream_.is_open()) stream_ << line_of(listed(values), result) << std::flush;
}

}  // namespace supine::calibration
