// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/embedding.h"

#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkStaticCellLocator.h>
#include <vtkUnstructuredGrid.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "simulation/elements.h"

namespace supine::simulation {
namespace {

// Corners are enough to locate a point: cells have straight edges in the imaged shape or nearly so.
vtkNew<vtkUnstructuredGrid> corner_grid(const meshing::TetMesh& mesh) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(mesh.points.rows());
  for (Eigen::Index p = 0; p < mesh.points.rows(); ++p) points->SetPoint(p, mesh.points.row(p).data());
  vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(points);
  grid->AllocateExact(mesh.cells.rows(), 4 * mesh.cells.rows());
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const vtkIdType corners[4] = {mesh.cells(c, 0), mesh.cells(c, 1), mesh.cells(c, 2), mesh.cells(c, 3)};
    grid->InsertNextCell(VTK_TETRA, 4, corners);
  }
  return grid;
}

Eigen::Vector4d barycentric(const meshing::TetMesh& mesh, Eigen::Index cell, const Eigen::Vector3d& point) {
  Eigen::Matrix4d corners;
  for (int a = 0; a < 4; ++a) corners.col(a) << mesh.points.row(mesh.cells(cell, a)).transpose(), 1;
  return corners.fullPivLu().solve(point.homogeneous());
}

}  // namespace

Embedding::Embedding(const meshing::TetMesh& mesh, const Points& points)
    : nodes_(points.rows(), mesh.cells.cols()), weight_(points.rows(), mesh.cells.cols()), outside_mm_(points.rows()) {
  const auto grid = corner_grid(mesh);
  vtkNew<vtkStaticCellLocator> locator;
  locator->SetDataSet(grid);
  locator->BuildLocator();
  vtkNew<vtkGenericCell> scratch;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    double at[3] = {points(p, 0), points(p, 1), points(p, 2)}, closest[3], distance2 = 0;
    vtkIdType cell = 0;
    int sub = 0;
    locator->FindClosestPoint(at, closest, scratch, cell, sub, distance2);
    outside_mm_[p] = std::sqrt(distance2);
    nodes_.row(p) = mesh.cells.row(cell);
    const Eigen::Vector4d b = barycentric(mesh, cell, points.row(p).transpose());
    if (mesh.order() == 2)
      weight_.row(p) = tet10_shape(b).transpose();
    else
      weight_.row(p) = b.transpose();
  }
}

Points Embedding::at(const Points& positions) const {
  Points moved = Points::Zero(nodes_.rows(), 3);
  for (Eigen::Index p = 0; p < nodes_.rows(); ++p)
    for (Eigen::Index a = 0; a < nodes_.cols(); ++a) moved.row(p) += weight_(p, a) * positions.row(nodes_(p, a));
  return moved;
}

}  // namespace supine::simulation
