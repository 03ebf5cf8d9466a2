// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/embedding.h"

#include <vtkCellLocator.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkUnstructuredGrid.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "simulation/elements/curved_cell.h"

namespace supine::simulation {
namespace {

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

/// Cells around each corner node.
std::vector<std::vector<int>> cells_of_nodes(const meshing::TetMesh& mesh) {
  std::vector<std::vector<int>> around(mesh.points.rows());
  for (int c = 0; c < mesh.cells.rows(); ++c)
    for (int a = 0; a < 4; ++a) around[mesh.cells(c, a)].push_back(c);
  return around;
}

/// The curved cell that holds @p point, among @p first and its neighbours; the closest where none does. First found,
/// first kept, so that equal distances change nothing.
int curved_cell(const meshing::TetMesh& mesh, const std::vector<std::vector<int>>& around, int first,
                const Eigen::Vector3d& point, CurvedPlace& best) {
  best = CurvedCell(mesh.points, mesh.cells, first).find(point, barycentric(mesh, first, point));
  int cell = first;
  for (int a = 0; a < 4 && best.outside_mm > 0; ++a)
    for (const int other : around[mesh.cells(first, a)]) {
      const CurvedCell curved(mesh.points, mesh.cells, other);
      if (curved.least_distance_mm(point) >= best.outside_mm) continue;
      const CurvedPlace place = curved.find(point, barycentric(mesh, other, point));
      if (place.outside_mm >= best.outside_mm) continue;
      best = place;
      cell = other;
      if (best.outside_mm == 0) break;
    }
  return cell;
}

}  // namespace

Embedding::Embedding(const meshing::TetMesh& mesh, const Points& points)
    : nodes_(points.rows(), mesh.cells.cols()), weight_(points.rows(), mesh.cells.cols()), outside_mm_(points.rows()) {
  const auto grid = corner_grid(mesh);
  const auto around = mesh.order() == 2 ? cells_of_nodes(mesh) : std::vector<std::vector<int>>();
  // vtkStaticCellLocator is built on several threads: the order inside its bins, and so which of two cells a point on
  // their common face gets, is that of chance.
  vtkNew<vtkCellLocator> locator;
  locator->SetDataSet(grid);
  locator->BuildLocator();
  vtkNew<vtkGenericCell> scratch;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    double at[3] = {points(p, 0), points(p, 1), points(p, 2)}, closest[3], distance2 = 0;
    const Eigen::Vector3d point = points.row(p).transpose();
    vtkIdType straight = 0;
    int sub = 0;
    locator->FindClosestPoint(at, closest, scratch, straight, sub, distance2);
    int cell = static_cast<int>(straight);
    if (mesh.order() == 2) {
      CurvedPlace place;
      cell = curved_cell(mesh, around, cell, point, place);
      outside_mm_[p] = place.outside_mm;
      weight_.row(p) = CurvedCell(mesh.points, mesh.cells, cell).weights(point, place.b).transpose();
    } else {
      outside_mm_[p] = std::sqrt(distance2);
      weight_.row(p) = barycentric(mesh, cell, point).transpose();
    }
    nodes_.row(p) = mesh.cells.row(cell);
  }
}

Points Embedding::at(const Points& positions) const {
  Points moved = Points::Zero(nodes_.rows(), 3);
  for (Eigen::Index p = 0; p < nodes_.rows(); ++p)
    for (Eigen::Index a = 0; a < nodes_.cols(); ++a) moved.row(p) += weight_(p, a) * positions.row(nodes_(p, a));
  return moved;
}

}  // namespace supine::simulation
