// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/comparison_files.h"

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

namespace supine::calibration {
namespace {

void add_strings(vtkFieldData* to, const char* name, const std::vector<std::string>& values) {
  vtkNew<vtkStringArray> array;
  array->SetName(name);
  for (const auto& value : values) array->InsertNextValue(value);
  to->AddArray(array);
}

void add_distances(vtkPolyData* to, const Eigen::VectorXd& distance_mm) {
  vtkNew<vtkDoubleArray> array;
  array->SetName("distance_mm");
  for (const double d : distance_mm) array->InsertNextValue(d);
  to->GetPointData()->AddArray(array);
  to->GetPointData()->SetActiveScalars("distance_mm");
}

template <class Values>
void add_integers(vtkPolyData* to, const char* name, const Values& values) {
  vtkNew<vtkIntArray> array;
  array->SetName(name);
  for (const auto value : values) array->InsertNextValue(static_cast<int>(value));
  to->GetPointData()->AddArray(array);
}

vtkNew<vtkPolyData> surface(const Points& points, const Triangles& triangles) {
  vtkNew<vtkPolyData> poly;
  vtkNew<vtkPoints> places;
  places->SetDataTypeToDouble();
  for (const auto& p : points.rowwise()) places->InsertNextPoint(p.data());
  poly->SetPoints(places);
  vtkNew<vtkCellArray> cells;
  for (const auto& t : triangles.rowwise()) cells->InsertNextCell({t[0], t[1], t[2]});
  if (triangles.rows() > 0) {
    poly->SetPolys(cells);
  } else {
    for (vtkIdType i = 0; i < points.rows(); ++i) cells->InsertNextCell(1, &i);
    poly->SetVerts(cells);
  }
  add_strings(poly->GetFieldData(), "frame", {"LPS"});
  add_strings(poly->GetFieldData(), "unit", {"mm"});
  return poly;
}

void write(vtkPolyData* poly, const std::filesystem::path& file) {
  // VTK would print its own complaint about a file that cannot be opened.
  bool written = std::ofstream(file).is_open();
  if (written) {
    vtkNew<vtkXMLPolyDataWriter> writer;
    writer->SetFileName(file.c_str());
    writer->SetInputData(poly);
    written = writer->Write() == 1 && writer->GetErrorCode() == 0;
  }
  if (!written) throw InputError(fmt::format("{}: cannot be written (disk full, or no permission?)", file.string()));
}

void add_areas(vtkPolyData* to, const ModelSkin& model, const SkinAreas& areas) {
  const Eigen::VectorXi area = areas.of_point(model.nodes());
  vtkNew<vtkStringArray> names;
  names->SetName("area_name");
  for (const int a : area) names->InsertNextValue(areas.names[a]);
  to->GetPointData()->AddArray(names);
  add_integers(to, "area", area);
  add_strings(to->GetFieldData(), "area_names", areas.names);
}

}  // namespace

void write_comparison(const Comparison& comparison, const ModelSkin& model, const SkinAreas& areas,
                      const std::filesystem::path& file) {
  std::vector<int> row(model.distance().points().rows(), -1);
  for (std::size_t i = 0; i < model.nodes().size(); ++i) row[model.nodes()[i]] = static_cast<int>(i);
  Triangles triangles = model.triangles();
  for (int& node : triangles.reshaped()) node = row[node];
  const auto poly = surface(model.node_points(), triangles);
  add_distances(poly, comparison.model_to_scan.to_scan.distance_mm);
  add_integers(poly, "covered", comparison.model_to_scan.covered);
  if (!areas.names.empty()) add_areas(poly, model, areas);
  write(poly, file);
}

void write_scan(const Comparison& comparison, const Scan& scan, const std::filesystem::path& file) {
  const auto poly = surface(scan.points(), scan.distance().triangles());
  add_distances(poly, comparison.scan_to_model.distance_mm);
  add_integers(poly, "used", comparison.used);
  write(poly, file);
}

}  // namespace supine::calibration
