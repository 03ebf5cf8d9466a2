// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "calibration/uncertainty.h"

namespace supine::pipeline {

/// Profile intervals by parameter. In a file: a row `parameter,low,high,runs` each, numbers with all their digits.
using Profiles = std::map<std::string, calibration::Profile>;

/// @throws InputError  the stream failed
void write_profiles(const Profiles& profiles, std::ostream& stream);

/// @throws InputError  naming file and line: what write_profiles() does not write
Profiles read_profiles(const std::filesystem::path& file);

/// All of them in one.
/// @param parts       with the file each came from
/// @param parameters  of the model: all must be there, and no other
/// @throws InputError  a parameter in no part, in two, or of another model
Profiles merge_profiles(const std::vector<std::pair<std::filesystem::path, Profiles>>& parts,
                        const std::vector<std::string>& parameters);

}  // namespace supine::pipeline
