// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "pipeline/case/measured_case.h"

namespace supine::pipeline {

/// What chain runs of a measured case depend on, in one line: version and commit of the program, hashes of case file,
/// model, mesh and fitted surfaces. For calibration::RunJournal.
std::string journal_key(const MeasuredCase& measured, const std::filesystem::path& case_folder,
                        const std::filesystem::path& mesh_file);

}  // namespace supine::pipeline
