// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

class vtkPolyData;

namespace supine::calibration {

/// Adds a point array.
void add_numbers(vtkPolyData& to, const std::string& name, const Eigen::VectorXd& values);
void add_integers(vtkPolyData& to, const std::string& name, const std::vector<int>& values);

/// Adds a field array.
void add_strings(vtkPolyData& to, const std::string& name, const std::vector<std::string>& values);

/// Writes a .vtp with the field data `frame` = LPS and `unit` = mm. Same content, same bytes.
/// @throws InputError  when the file cannot be written
void write_polydata(vtkPolyData& poly, const std::filesystem::path& file);

}  // namespace supine::calibration
