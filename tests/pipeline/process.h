// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace supine::pipeline {

/// What a finished process left.
struct Finished {
  int code = -1;  ///< exit code; 128 + signal when a signal ended it
  std::string out, err;
};

/// Runs a program to its end. With @p interrupt_after, SIGINT is sent to the process (and what it started) once
/// that text has appeared on its standard output.
Finished run_process(const std::vector<std::string>& command, const std::string& interrupt_after = "");

/// Path of a built tool, for example tool("segment").
std::string tool(const std::string& name);

/// Regular files in @p folder and below, relative to it, sorted; none when it is not there.
std::vector<std::string> files_in(const std::filesystem::path& folder);

}  // namespace supine::pipeline
