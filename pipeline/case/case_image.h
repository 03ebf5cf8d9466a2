// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "common/toml_reader.h"
#include "pipeline/case/case.h"

namespace supine::pipeline {

/// Path of a file a case names, relative to the folder of the case.
/// @throws InputError  naming the key when it is not there
std::filesystem::path case_path(const TomlReader& reader, std::string_view key, bool folder_allowed);

/// The names of a table's entries in the order of the file: what becomes the name of an array.
/// @throws InputError  a name of other characters than letters, digits and _
std::vector<std::string> plain_names(const TomlReader& table);

/// Fills in what the tables [image], [image.labels] and [segmentation] say.
void read_case_image(const TomlReader& file, Case& result);

}  // namespace supine::pipeline
