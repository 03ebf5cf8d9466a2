// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "common/toml_reader.h"
#include "pipeline/case/case.h"

namespace supine::pipeline {

/// Path of a file a case names, relative to the folder of the case.
/// @throws InputError  naming the key when it is not there
std::filesystem::path case_path(const TomlReader& reader, std::string_view key, bool folder_allowed);

/// Fills in what the tables [image], [image.labels] and [segmentation] say.
void read_case_image(const TomlReader& file, Case& result);

}  // namespace supine::pipeline
