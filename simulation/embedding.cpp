// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/embedding.h"

#include <vtkCellLocator.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkUnstructuredGrid.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "simulation/elements/elements.h"
#include "simulation/terms/term.h"

namespace supine::simulation {
namespace {

constexpr double inside_tolerance = 1e-9;  // of barycentric coordinates
constexpr int max_newton = 30, max_descent = 200;
constexpr double settled = 1e-13;  // a change of barycentric coordinates that is rounding

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

/// Closest barycentric coordinates without a negative one.
Eigen::Vector4d onto_simplex(const Eigen::Vector4d& b) {
  Eigen::Vector4d sorted = b;
  std::sort(sorted.data(), sorted.data() + 4, std::greater<>());
  double sum = 0, shift = 0;
  for (int i = 0; i < 4; ++i) {
    sum += sorted[i];
    if (sorted[i] > (sum - 1) / (i + 1)) shift = (sum - 1) / (i + 1);
  }
  return (b.array() - shift).max(0.0);
}

/// A place in a quadratic cell and what the cell's curved map makes of it.
struct CurvedPlace {
  Eigen::Vector4d b;
  double outside_mm = 1e300;  // of the point from the cell; 0 inside
};

class CurvedCell {
 public:
  CurvedCell(const meshing::TetMesh& mesh, int cell) : nodes_(gather<10>(mesh.points, mesh.cells, cell)) {}

  /// Finds @p point by Newton's method on the quadratic map, from the barycentrics @p b; outside, the closest place.
  CurvedPlace find(const Eigen::Vector3d& point, const Eigen::Vector4d& b) const {
    CurvedPlace place{onto_simplex(b)};
    for (int iteration = 0; iteration < max_newton; ++iteration) {
      const Eigen::Vector3d step = jacobian(place.b).fullPivLu().solve(point - at(place.b));
      if (!step.allFinite()) break;
      const double size = step.cwiseAbs().maxCoeff(), share = std::min(1.0, 0.5 / size);
      move(place.b, share * step);
      if (size > settled) continue;
      if (place.b.minCoeff() >= -inside_tolerance) place.outside_mm = 0;
      break;
    }
    return place.outside_mm == 0 ? place : closest(point, b);
  }

  /// Shape functions at a place, continued from there along the cell's tangent map to @p point.
  Eigen::Matrix<double, 10, 1> weights(const Eigen::Vector3d& point, const Eigen::Vector4d& b) const {
    const Eigen::Vector3d rest = jacobian(b).fullPivLu().solve(point - at(b));
    return tet10_shape(b) + tet10_gradient(b) * rest;
  }

 private:
  Eigen::Vector3d at(const Eigen::Vector4d& b) const { return nodes_.transpose() * tet10_shape(b); }
  Eigen::Matrix3d jacobian(const Eigen::Vector4d& b) const { return nodes_.transpose() * tet10_gradient(b); }

  /// ∂N/∂ξ is linear in b: the corners' values, mixed.
  static Eigen::Matrix<double, 10, 3> tet10_gradient(const Eigen::Vector4d& b) {
    Eigen::Matrix<double, 10, 3> gradient = Eigen::Matrix<double, 10, 3>::Zero();
    for (int a = 0; a < 4; ++a) gradient += b[a] * tet10_corner_gradients()[a];
    return gradient;
  }
  static void move(Eigen::Vector4d& b, const Eigen::Vector3d& step) {
    b[0] -= step.sum();
    b.tail<3>() += step;
  }

  /// Closest place of the cell by projected descent.
  CurvedPlace closest(const Eigen::Vector3d& point, const Eigen::Vector4d& start) const {
    CurvedPlace place{onto_simplex(start)};
    double distance = (point - at(place.b)).norm();
    double rate = 1 / jacobian(place.b).squaredNorm();
    for (int iteration = 0; iteration < max_descent; ++iteration) {
      const Eigen::Vector3d step = rate * jacobian(place.b).transpose() * (point - at(place.b));
      Eigen::Vector4d next = place.b;
      move(next, step);
      next = onto_simplex(next);
      const double further = (point - at(next)).norm();
      if (further > distance) {
        rate *= 0.5;
        continue;
      }
      const bool done = (next - place.b).cwiseAbs().maxCoeff() < 1e-10;
      place.b = next;
      distance = further;
      if (done) break;
    }
    place.outside_mm = distance;
    return place;
  }

  NodeRows<10> nodes_;
};

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
  best = CurvedCell(mesh, first).find(point, barycentric(mesh, first, point));
  int cell = first;
  for (int a = 0; a < 4 && best.outside_mm > 0; ++a)
    for (const int other : around[mesh.cells(first, a)]) {
      const CurvedPlace place = CurvedCell(mesh, other).find(point, barycentric(mesh, other, point));
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
      weight_.row(p) = CurvedCell(mesh, cell).weights(point, place.b).transpose();
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
