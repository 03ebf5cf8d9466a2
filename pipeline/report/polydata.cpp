// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/polydata.h"

#include <fmt/core.h>
#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkDecimatePro.h>
#include <vtkDoubleArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/vtk_files.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

Points points_of(vtkPolyData& poly) {
  Points points(poly.GetNumberOfPoints(), 3);
  for (vtkIdType i = 0; i < poly.GetNumberOfPoints(); ++i) poly.GetPoint(i, points.row(i).data());
  return points;
}

/// @throws InputError when a polygon is not a triangle
Triangles triangles_of(vtkPolyData& poly, const std::string& name) {
  Triangles triangles(poly.GetNumberOfPolys(), 3);
  const auto cells = vtk::TakeSmartPointer(poly.GetPolys()->NewIterator());
  Eigen::Index row = 0;
  for (cells->GoToFirstCell(); !cells->IsDoneWithTraversal(); cells->GoToNextCell(), ++row) {
    vtkIdType size = 0;
    const vtkIdType* ids = nullptr;
    cells->GetCurrentCell(size, ids);
    if (size != 3)
      throw InputError(fmt::format("{}: polygon {} has {} corners; only triangles are read", name, row, size));
    for (int k = 0; k < 3; ++k) triangles(row, k) = static_cast<int>(ids[k]);
  }
  return triangles;
}

vtkNew<vtkPolyData> numbered_surface(const Points& points, const Triangles& triangles) {
  vtkNew<vtkPolyData> poly;
  vtkNew<vtkPoints> places;
  places->SetDataTypeToDouble();
  vtkNew<vtkIntArray> rows;
  rows->SetName("row");
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    places->InsertNextPoint(points.row(i).data());
    rows->InsertNextValue(static_cast<int>(i));
  }
  vtkNew<vtkCellArray> cells;
  for (const auto& t : triangles.rowwise()) cells->InsertNextCell({t[0], t[1], t[2]});
  poly->SetPoints(places);
  poly->SetPolys(cells);
  poly->GetPointData()->AddArray(rows);
  return poly;
}

/// Every n-th point.
Thinned thin_points(Eigen::Index count, int most) {
  Thinned kept;
  const auto step = std::max<Eigen::Index>(1, (count + most - 1) / most);
  for (Eigen::Index i = 0; i < count; i += step) kept.points.push_back(static_cast<int>(i));
  return kept;
}

/// Points in the order of the input, so that the result does not depend on the filter's order.
Thinned in_order(vtkPolyData& poly) {
  auto* row = vtkIntArray::SafeDownCast(poly.GetPointData()->GetArray("row"));
  const Triangles triangles = triangles_of(poly, "decimated surface");
  Thinned kept;
  for (const int corner : triangles.reshaped()) kept.points.push_back(row->GetValue(corner));
  std::sort(kept.points.begin(), kept.points.end());
  kept.points.erase(std::unique(kept.points.begin(), kept.points.end()), kept.points.end());
  kept.triangles = triangles.unaryExpr([&](int corner) {
    return static_cast<int>(std::lower_bound(kept.points.begin(), kept.points.end(), row->GetValue(corner)) -
                            kept.points.begin());
  });
  return kept;
}

}  // namespace

const Eigen::VectorXd& PolyData::array(const std::string& name, const fs::path& file) const {
  const auto found = point_arrays.find(name);
  if (found == point_arrays.end())
    throw InputError(fmt::format("{}: no point array '{}'; write the file again with its tool", file.string(), name));
  return found->second;
}

PolyData read_polydata(const fs::path& file) {
  const auto read = read_vtp(file);
  vtkPolyData& poly = *read;
  if (poly.GetNumberOfPoints() == 0)
    throw InputError(fmt::format("{}: has no points; write it again with its tool", file.string()));
  PolyData data{points_of(poly), triangles_of(poly, file.string()), {}};
  for (int a = 0; a < poly.GetPointData()->GetNumberOfArrays(); ++a) {
    vtkDataArray* values = poly.GetPointData()->GetArray(a);
    if (values == nullptr || values->GetNumberOfComponents() != 1) continue;
    Eigen::VectorXd numbers(values->GetNumberOfTuples());
    for (vtkIdType i = 0; i < values->GetNumberOfTuples(); ++i) numbers[i] = values->GetComponent(i, 0);
    data.point_arrays.emplace(values->GetName(), numbers);
  }
  return data;
}

Thinned thin_out(const Points& points, const Triangles& triangles, int most_triangles) {
  if (triangles.rows() == 0) return thin_points(points.rows(), most_triangles);
  const auto poly = numbered_surface(points, triangles);
  if (triangles.rows() <= most_triangles) return in_order(*poly);
  vtkNew<vtkDecimatePro> decimate;
  decimate->SetInputData(poly);
  decimate->SetTargetReduction(1 - static_cast<double>(most_triangles) / static_cast<double>(triangles.rows()));
  decimate->PreserveTopologyOff();
  decimate->SplittingOff();
  decimate->BoundaryVertexDeletionOn();
  decimate->Update();
  return in_order(*decimate->GetOutput());
}

}  // namespace supine::pipeline
