// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

namespace supine::pipeline {

/// SHA-256 of a file's bytes, 64 lower-case hexadecimal digits. Of a folder (DICOM): of the names and hashes of
/// the files directly in it, sorted by name.
/// @throws InputError  when a file cannot be read
std::string sha256(const std::filesystem::path& file_or_folder);

}  // namespace supine::pipeline
