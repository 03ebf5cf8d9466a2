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

void write(vtkPolyData* poly, const std::filesystem::path& file) {
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
  write(poly, file);
}

void write_error_map(const calibration::ModelSkin& skin, const SkinError& error, const calibration::SkinAreas& areas,
                     const std::filesystem::path& file) {
  vtkNew<vtkPolyData> poly;
  vtkNew<vtkPoints> places;
  places->SetDataTypeToDouble();
  const std::vector<int>& nodes = skin.nodes();
  std::vector<vtkIdType> row(static_cast<std::size_t>(skin.distance().points().rows()), -1);
  for (const int node : nodes)
    row[static_cast<std::size_t>(node)] = places->InsertNextPoint(skin.distance().points().row(node).data());
  vtkNew<vtkCellArray> cells;
  for (Eigen::Index t = 0; t < skin.triangles().rows(); ++t) {
    vtkIdType corners[3];
    for (int k = 0; k < 3; ++k) corners[k] = row[static_cast<std::size_t>(skin.triangles()(t, k))];
    cells->InsertNextCell(3, corners);
  }
  poly->SetPoints(places);
  poly->SetPolys(cells);
  add_numbers(poly, "distance_mm", error.mean_mm(nodes));
  poly->GetPointData()->SetActiveScalars("distance_mm");
  add_numbers(poly, "standard_error_mm", error.error_mm(nodes));
  if (!areas.names.empty()) {
    vtkNew<vtkIntArray> area;
    area->SetName("area");
    for (const int node : nodes) area->InsertNextValue(areas.of_point[node]);
    poly->GetPointData()->AddArray(area);
    add_strings(poly, "area_names", areas.names);
  }
  write(poly, file);
}

}  // namespace supine::diagnosis
