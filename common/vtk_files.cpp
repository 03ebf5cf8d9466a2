// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/vtk_files.h"

#include <fmt/core.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <cmath>

#include "common/error.h"
#include "common/trial_process.h"
#include "common/vtk_errors.h"

namespace supine {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, const std::string& what) {
  throw InputError(fmt::format("{}: {}; write the file again", file.string(), what));
}

void check_points(const fs::path& file, vtkPointSet& data) {
  if (data.GetPoints() == nullptr) return;
  vtkDataArray& points = *data.GetPoints()->GetData();
  if (points.GetNumberOfComponents() != 3)
    refuse(file, fmt::format("its points have {} coordinates each, not 3", points.GetNumberOfComponents()));
  double place[3];
  for (vtkIdType p = 0; p < points.GetNumberOfTuples(); ++p) {
    points.GetTuple(p, place);
    if (!std::isfinite(place[0]) || !std::isfinite(place[1]) || !std::isfinite(place[2]))
      refuse(file, fmt::format("point {} has a coordinate that is not a finite number", p));
  }
}

/// Offsets first: corners are found through them.
void check_offsets(const fs::path& file, vtkCellArray& cells, const std::string& what) {
  vtkDataArray& offsets = *cells.GetOffsetsArray();
  const vtkIdType corners = cells.GetConnectivityArray()->GetNumberOfTuples();
  if (offsets.GetNumberOfComponents() != 1 || cells.GetConnectivityArray()->GetNumberOfComponents() != 1)
    refuse(file, fmt::format("offsets and connectivity of its {}s have one number each", what));
  for (vtkIdType c = 0; c < offsets.GetNumberOfTuples(); ++c) {
    const double begins = offsets.GetComponent(c, 0), before = c > 0 ? offsets.GetComponent(c - 1, 0) : 0;
    if (c == 0 ? begins != 0 : begins < before || begins > static_cast<double>(corners))
      refuse(file,
             fmt::format("offset {} of its {}s is {}, after {}, of {} corners", c, what, begins, before, corners));
  }
}

/// @param fewest  corners of a cell
void check_cells(const fs::path& file, vtkCellArray* cells, vtkIdType points, int fewest, const std::string& what) {
  if (cells == nullptr || cells->GetNumberOfCells() == 0) return;
  check_offsets(file, *cells, what);
  for (vtkIdType c = 0; c < cells->GetNumberOfCells(); ++c) {
    vtkIdType size = 0;
    const vtkIdType* ids = nullptr;
    cells->GetCellAtId(c, size, ids);
    if (size < fewest)
      refuse(file, fmt::format("{} {} has {} corners; {} and more are expected", what, c, size, fewest));
    for (vtkIdType i = 0; i < size; ++i)
      if (ids[i] < 0 || ids[i] >= points)
        refuse(file, fmt::format("{} {} names point {}, the file has {}", what, c, ids[i], points));
  }
}

void check_arrays(const fs::path& file, vtkFieldData& arrays, vtkIdType count, const std::string& what) {
  for (int a = 0; a < arrays.GetNumberOfArrays(); ++a) {
    vtkAbstractArray& array = *arrays.GetAbstractArray(a);
    if (array.GetName() == nullptr) refuse(file, fmt::format("array {} of its {}s has no name", a, what));
    if (array.GetNumberOfComponents() < 1 || array.GetNumberOfTuples() != count)
      refuse(file, fmt::format("array \"{}\" has {} × {} values for {} {}s", array.GetName(), array.GetNumberOfTuples(),
                               array.GetNumberOfComponents(), count, what));
  }
}

void check_kind(const fs::path& file, vtkPolyData& data) {
  check_points(file, data);
  const vtkIdType points = data.GetNumberOfPoints();
  check_cells(file, data.GetVerts(), points, 0, "vertex");
  check_cells(file, data.GetLines(), points, 0, "line");
  check_cells(file, data.GetPolys(), points, 3, "face");
  check_cells(file, data.GetStrips(), points, 3, "strip");
}

void check_kind(const fs::path& file, vtkUnstructuredGrid& data) {
  check_points(file, data);
  check_cells(file, data.GetCells(), data.GetNumberOfPoints(), 0, "cell");
  if (data.GetFaces() != nullptr) refuse(file, "has polyhedra, which are not read");
  const vtkIdType cells = data.GetCells() == nullptr ? 0 : data.GetCells()->GetNumberOfCells();
  const vtkIdType types = data.GetCellTypesArray() == nullptr ? 0 : data.GetCellTypesArray()->GetNumberOfValues();
  if (types != cells) refuse(file, fmt::format("has types of {} cells, and {} cells", types, cells));
}

void check_kind(const fs::path&, vtkImageData&) {}

template <class Data>
void check_all(const fs::path& file, Data& data) {
  check_kind(file, data);
  check_arrays(file, *data.GetPointData(), data.GetNumberOfPoints(), "point");
  check_arrays(file, *data.GetCellData(), data.GetNumberOfCells(), "cell");
}

template <class Reader, class Data>
vtkSmartPointer<Data> read_once(const fs::path& file) {
  vtkNew<Reader> reader;
  const VtkErrors errors(*reader);
  if (reader->CanReadFile(file.c_str()) == 0)
    refuse(file, fmt::format("not a readable {} file: VTK does not know it", file.extension().string()));
  reader->SetFileName(file.c_str());
  reader->Update();
  if (errors.any())
    refuse(file,
           fmt::format("not a readable {} file (cut short or damaged): {}", file.extension().string(), errors.text()));
  const vtkSmartPointer<Data> data = reader->GetOutput();
  check_all(file, *data);
  return data;
}

template <class Reader, class Data>
vtkSmartPointer<Data> read_tried(const fs::path& file) {
  if (!fs::is_regular_file(file)) throw InputError(fmt::format("{}: there is no such file", file.string()));
  check_survivable(file, [&file] { read_once<Reader, Data>(file); });
  return read_once<Reader, Data>(file);
}

}  // namespace

vtkSmartPointer<vtkPolyData> read_vtp(const fs::path& file) {
  return read_tried<vtkXMLPolyDataReader, vtkPolyData>(file);
}

vtkSmartPointer<vtkUnstructuredGrid> read_vtu(const fs::path& file) {
  return read_tried<vtkXMLUnstructuredGridReader, vtkUnstructuredGrid>(file);
}

vtkSmartPointer<vtkImageData> read_vti(const fs::path& file) {
  return read_tried<vtkXMLImageDataReader, vtkImageData>(file);
}

void check_sound(const fs::path& file, vtkPolyData& data) { check_all(file, data); }

std::vector<std::string> field_texts(vtkDataSet& data, const std::string& name) {
  auto* array = vtkStringArray::SafeDownCast(data.GetFieldData()->GetAbstractArray(name.c_str()));
  std::vector<std::string> values;
  for (vtkIdType i = 0; array != nullptr && i < array->GetNumberOfValues(); ++i) values.push_back(array->GetValue(i));
  return values;
}

std::optional<std::string> field_text(vtkDataSet& data, const std::string& name) {
  const std::vector<std::string> values = field_texts(data, name);
  return values.empty() ? std::nullopt : std::optional(values.front());
}

}  // namespace supine
