// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace supine::calibration {

/// What one chain run gave.
struct RunResult {
  bool failed = true;                               ///< no equilibrium
  double mae_study_mm = 0, mae_mm = 0, rms_mm = 0;  ///< meaningless when it failed
};

/// A file that remembers every chain run of long work, so that an interrupted one goes on where it was: one line per
/// run, written at once. Since numbers are stored with all their digits and looked up by the parameters themselves,
/// finished work gives the same bytes whether it was interrupted or not.
class RunJournal {
 public:
  /// Remembers nothing.
  RunJournal() = default;
  /// @param file  read when it is there and its first line is @p key (what the runs depend on: hashes of inputs and
  ///   program), begun anew otherwise
  /// @throws InputError  the file cannot be written
  RunJournal(const std::filesystem::path& file, const std::string& key);

  std::optional<RunResult> find(const Eigen::VectorXd& values) const;
  /// Threads may call it at the same time.
  void add(const Eigen::VectorXd& values, const RunResult& result);
  std::size_t known() const { return runs_.size(); }
  /// To be removed once the work's results are safe.
  const std::filesystem::path& file() const { return file_; }

 private:
  void read(const std::string& key);

  std::filesystem::path file_;
  std::ofstream stream_;
  std::map<std::vector<double>, RunResult> runs_;
  mutable std::mutex mutex_;
};

}  // namespace supine::calibration
