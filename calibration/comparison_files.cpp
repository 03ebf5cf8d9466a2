// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/comparison_files.h"

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>

#include "calibration/polydata_file.h"

namespace supine::calibration {
namespace {

void add_distances(vtkPolyData& to, const Eigen::VectorXd& distance_mm) {
  add_numbers(to, "distance_mm", distance_mm);
  to.GetPointData()->SetActiveScalars("distance_mm");
}

template <class Flags>
std::vector<int> integers(const Flags& flags) {
  return {flags.begin(), flags.end()};
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
  return poly;
}

void add_areas(vtkPolyData& to, const ModelSkin& model, const SkinAreas& areas) {
  const Eigen::VectorXi area = areas.of_point(model.nodes());
  vtkNew<vtkStringArray> names;
  names->SetName("area_name");
  for (const int a : area) names->InsertNextValue(areas.names[a]);
  to.GetPointData()->AddArray(names);
  add_integers(to, "area", integers(area));
  add_strings(to, "area_names", areas.names);
}

}  // namespace

void write_comparison(const Comparison& comparison, const ModelSkin& model, const SkinAreas& areas,
                      const std::filesystem::path& file) {
  std::vector<int> row(model.distance().points().rows(), -1);
  for (std::size_t i = 0; i < model.nodes().size(); ++i) row[model.nodes()[i]] = static_cast<int>(i);
  Triangles triangles = model.triangles();
  for (int& node : triangles.reshaped()) node = row[node];
  const auto poly = surface(model.node_points(), triangles);
  add_distances(*poly, comparison.model_to_scan.to_scan.distance_mm);
  add_integers(*poly, "covered", integers(comparison.model_to_scan.covered));
  if (!areas.names.empty()) add_areas(*poly, model, areas);
  write_polydata(*poly, file);
}

void write_scan(const Comparison& comparison, const Scan& scan, const std::filesystem::path& file) {
  const auto poly = surface(scan.points(), scan.distance().triangles());
  add_distances(*poly, comparison.scan_to_model.distance_mm);
  add_integers(*poly, "used", integers(comparison.used));
  write_polydata(*poly, file);
}

}  // namespace supine::calibration
