// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/diagnosis_file.h"

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataWriter.h>

#include <fstream>

#include "common/error.h"

namespace supine::diagnosis {
namespace {

void add_numbers(vtkPolyData* to, const std::string& name, const Eigen::VectorXd& values) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  for (const double value : values) array->InsertNextValue(value);
  to->GetPointData()->AddArray(array);
}

void add_strings(vtkPolyData* to, const char* name, const std::vector<std::string>& values) {
  vtkNew<vtkStringArray> array;
  array->SetName(name);
  for (const std::string& value : values) array->InsertNextValue(value);
  to->GetFieldData()->AddArray(array);
}

}  // namespace

void write_diagnosis(const calibration::Residuals& residuals, const std::vector<std::string>& poses,
                     const std::vector<std::pair<std::string, Eigen::VectorXd>>& shapes,
                     const std::filesystem::path& file) {
  vtkNew<vtkPolyData> poly;
  vtkNew<vtkPoints> places;
  places->SetDataTypeToDouble();
  vtkNew<vtkCellArray> cells;
  for (vtkIdType i = 0; i < residuals.size(); ++i) {
    places->InsertNextPoint(residuals.place.row(i).data());
    cells->InsertNextCell(1, &i);
  }
  poly->SetPoints(places);
  poly->SetVerts(cells);
  add_numbers(poly, "distance_mm", residuals.distance_mm);
  poly->GetPointData()->SetActiveScalars("distance_mm");
  vtkNew<vtkIntArray> pose;
  pose->SetName("pose");
  for (const int row : residuals.pose) pose->InsertNextValue(row);
  poly->GetPointData()->AddArray(pose);
  for (const auto& [effect, shape] : shapes) add_numbers(poly, "shape_" + effect + "_mm", shape);
  add_strings(poly, "poses", poses);
  add_strings(poly, "frame", {"LPS"});
  add_strings(poly, "unit", {"mm"});
  bool written = std::ofstream(file).is_open();  // VTK would print its own complaint
  if (written) {
    vtkNew<vtkXMLPolyDataWriter> writer;
    writer->SetFileName(file.c_str());
    writer->SetInputData(poly);
    written = writer->Write() == 1 && writer->GetErrorCode() == 0;
  }
  if (!written) throw InputError(fmt::format("{}: cannot be written (disk full, or no permission?)", file.string()));
}

}  // namespace supine::diagnosis
