// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <utility>
#include <vector>

namespace supine {

/// A set of files that appear together or not at all.
///
/// Each file is written under a temporary name in its own folder and renamed by commit().
/// Leaving without commit() removes the temporary files and the folders made for them, and so does Ctrl-C once
/// install_interrupt_handler() has been called (there the folders stay): no half-written file is ever seen.
class Outputs {
 public:
  /// @param force  whether existing files may be replaced
  explicit Outputs(bool force) : force_(force) {}
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;
  ~Outputs();

  /// Announces the file @p target and returns the temporary path to write to (same extension,
  /// because writers choose their format by it). Missing parent folders are created.
  /// @throws InputError  when the folder is not writable, the target is a folder, device or pipe, or the file exists
  /// and force is off
  std::filesystem::path stage(const std::filesystem::path& target);

  /// Renames every staged file to its target.
  void commit();

 private:
  bool force_;
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> staged_;  // temporary, target
  std::vector<std::filesystem::path> made_folders_;                              // outermost first
};

/// Makes SIGINT and SIGTERM remove the staged files and end the process with code 130.
void install_interrupt_handler();

}  // namespace supine
