// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/arrays.h"

namespace supine::pipeline {

/// A .vtp of ours: points (mm, LPS), triangles (none for bare points) and its one-component point arrays by name.
struct PolyData {
  Points points;
  Triangles triangles;
  std::map<std::string, Eigen::VectorXd> point_arrays;

  /// @throws InputError  naming @p file when the array is not there
  const Eigen::VectorXd& array(const std::string& name, const std::filesystem::path& file) const;
};

/// @throws InputError  naming the file: missing, not readable, cells other than triangles and vertices
PolyData read_polydata(const std::filesystem::path& file);

/// What is left of a surface for showing.
struct Thinned {
  std::vector<int> points;  ///< rows of the input that stay, ascending
  Triangles triangles;      ///< rows of `points`
};

/// At most about @p most_triangles of a surface (or that many points where there are no triangles): points stay where
/// they are, so whatever belongs to them (a distance, another pose) stays right. Same input, same result.
Thinned thin_out(const Points& points, const Triangles& triangles, int most_triangles);

}  // namespace supine::pipeline
