// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/arrays.h"

namespace supine {

/// Named points, for example the nipple; points.row(i) belongs to names[i], mm, LPS.
struct Landmarks {
  std::vector<std::string> names;
  Points points;
};

/// Reads a CSV file with the header `name,x,y,z`, mm, in @p frame (LPS or RAS; converted to LPS).
/// @throws InputError  naming file and line: wrong header, not four fields, not a number, a name twice
Landmarks read_landmarks(const std::filesystem::path& file, const std::string& frame = "LPS");

/// Writes the same format, LPS, three decimals.
void write_landmarks(const Landmarks& landmarks, const std::filesystem::path& file);

}  // namespace supine
