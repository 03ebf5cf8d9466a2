// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/diagnosis_file.h"

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include "calibration/polydata_file.h"

namespace supine::diagnosis {
using calibration::add_integers;
using calibration::add_numbers;
using calibration::add_strings;

namespace {

void add_vectors(vtkPolyData& to, const std::string& name, const Points& vectors) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(3);
  for (const auto& v : vectors.rowwise()) array->InsertNextTuple3(v.x(), v.y(), v.z());
  to.GetPointData()->AddArray(array);
}

}  // namespace

void write_diagnosis(const calibration::Residuals& residuals, const std::vector<std::string>& poses,
                     const std::vector<std::pair<std::string, Eigen::VectorXd>>& shapes, const ForceMap* forces,
                     const std::filesystem::path& file) {
  vtkNew<vtkPolyData> poly;
  vtkNew<vtkPoints> places;
  places->SetDataTypeToDouble();
  vtkNew<vtkCellArray> cells;
  for (vtkIdType i = 0; i < residuals.skin_rows(); ++i) {
    places->InsertNextPoint(residuals.place.row(i).data());
    cells->InsertNextCell(1, &i);
  }
  poly->SetPoints(places);
  poly->SetVerts(cells);
  add_numbers(*poly, "distance_mm", residuals.skin_mm());
  poly->GetPointData()->SetActiveScalars("distance_mm");
  add_integers(*poly, "pose", {residuals.pose.begin(), residuals.pose.begin() + residuals.skin_rows()});
  for (const auto& [effect, shape] : shapes)
    add_numbers(*poly, "shape_" + effect + "_mm", shape.head(residuals.skin_rows()));
  if (forces != nullptr) {
    add_vectors(*poly, "missing_force_kpa", forces->force_kpa);
    add_vectors(*poly, "missing_force_null_kpa", forces->null_kpa);
    add_strings(*poly, "missing_force_threshold_kpa", {fmt::format("{:.6g}", forces->threshold_kpa)});
    add_strings(*poly, "missing_force_meaning",
                {"a hint, no diagnosis: forces on the skin that would explain what is left; below the threshold they "
                 "mean nothing"});
  }
  add_strings(*poly, "poses", poses);
  calibration::write_polydata(*poly, file);
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
  add_numbers(*poly, "distance_mm", error.mean_mm(nodes));
  poly->GetPointData()->SetActiveScalars("distance_mm");
  add_numbers(*poly, "standard_error_mm", error.error_mm(nodes));
  if (!areas.names.empty()) {
    const Eigen::VectorXi area = areas.of_point(nodes);
    add_integers(*poly, "area", {area.begin(), area.end()});
    add_strings(*poly, "area_names", areas.names);
  }
  calibration::write_polydata(*poly, file);
}

}  // namespace supine::diagnosis
