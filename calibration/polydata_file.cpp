// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/polydata_file.h"

#include <fmt/format.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataWriter.h>

#include <fstream>

#include "common/error.h"

namespace supine::calibration {

void add_numbers(vtkPolyData& to, const std::string& name, const Eigen::VectorXd& values) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  for (const double value : values) array->InsertNextValue(value);
  to.GetPointData()->AddArray(array);
}

void add_integers(vtkPolyData& to, const std::string& name, const std::vector<int>& values) {
  vtkNew<vtkIntArray> array;
  array->SetName(name.c_str());
  for (const int value : values) array->InsertNextValue(value);
  to.GetPointData()->AddArray(array);
}

void add_strings(vtkPolyData& to, const std::string& name, const std::vector<std::string>& values) {
  vtkNew<vtkStringArray> array;
  array->SetName(name.c_str());
  for (const std::string& value : values) array->InsertNextValue(value);
  to.GetFieldData()->AddArray(array);
}

void write_polydata(vtkPolyData& poly, const std::filesystem::path& file) {
  add_strings(poly, "frame", {"LPS"});
  add_strings(poly, "unit", {"mm"});
  bool written = std::ofstream(file).is_open();  // VTK would print its own complaint
  if (written) {
    vtkNew<vtkXMLPolyDataWriter> writer;
    writer->SetFileName(file.c_str());
    writer->SetInputData(&poly);
    written = writer->Write() == 1 && writer->GetErrorCode() == 0;
  }
  if (!written) throw InputError(fmt::format("{}: cannot be written (disk full, or no permission?)", file.string()));
}

}  // namespace supine::calibration
