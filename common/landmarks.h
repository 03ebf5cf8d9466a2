// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/arrays.h"

namespace supine {

/// Named points, for example the nipple; points.row(i) belongs to names[i], mm, LPS.
struct Landmarks {
  std::vector<std::string> names;
  Points points;
  Eigen::VectorXd sigma_mm = {};  ///< 1 sigma of each point's error along every axis; empty: not stated

  /// Of the point of that name; none where there is no such point.
  std::optional<Eigen::Index> row_of(const std::string& name) const;
};

/// Reads a CSV file with the header `name,x,y,z` or `name,x,y,z,sigma_mm`, mm, in @p frame (LPS or RAS; converted to
/// LPS). Columns behind sigma_mm (regions of supine-targets) are not read.
/// @throws InputError  naming file and line: wrong header, more or fewer fields than it has, not a number, a sigma_mm
///   that is not > 0, a name twice
Landmarks read_landmarks(const std::filesystem::path& file, const std::string& frame = "LPS");

/// Writes the same format, LPS, three decimals; sigma_mm where it is stated.
void write_landmarks(const Landmarks& landmarks, const std::filesystem::path& file);

}  // namespace supine
