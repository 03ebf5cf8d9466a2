// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vtkSmartPointer.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

class vtkDataSet;
class vtkImageData;
class vtkPolyData;
class vtkUnstructuredGrid;

namespace supine {

/// Files of VTK's XML formats, read by VTK in a process of its own first (trial_process.h), then here. What is returned
/// can be handed to any filter of VTK:
///   - every point has three finite coordinates;
///   - the corners of each cell are points that are there; polygons and strips have three and more;
///   - every array of points or of cells has a name and as many tuples as there are points or cells.
/// Nothing is printed.
/// @throws InputError  not there, of another kind, damaged, or one of these is not so
vtkSmartPointer<vtkPolyData> read_vtp(const std::filesystem::path& file);
vtkSmartPointer<vtkUnstructuredGrid> read_vtu(const std::filesystem::path& file);
vtkSmartPointer<vtkImageData> read_vti(const std::filesystem::path& file);

/// The same of what another reader of VTK gave. @param file  for the message
void check_sound(const std::filesystem::path& file, vtkPolyData& data);

/// The strings of an array of field data; none when there is no such array.
std::vector<std::string> field_texts(vtkDataSet& data, const std::string& name);

/// The first of them.
std::optional<std::string> field_text(vtkDataSet& data, const std::string& name);

}  // namespace supine
