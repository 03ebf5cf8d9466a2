// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/pipeline/process.h"

namespace supine::pipeline {

/// Command line of a stage for the case in @p folder, with its files in folder/out and its output there:
/// segment, reconstruct, decimate, tetrahedralise, simulate, compare.
std::vector<std::string> stage_command(const std::string& stage, const std::filesystem::path& folder);

/// The make that takes the case in @p folder as far as its data allow, results in folder/out.
std::vector<std::string> make_command(const std::filesystem::path& folder);

/// Writes the small case into @p folder and makes it.
/// @throws std::runtime_error  with what the tool said, when a stage fails
void make_small_run(const std::filesystem::path& folder);

/// The folder of such a run, not to be changed: the one the environment variable SUPINE_SMALL_RUN names (ctest makes
/// it once for all tests), otherwise one of this process.
const std::filesystem::path& small_run();

}  // namespace supine::pipeline
