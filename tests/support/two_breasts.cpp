// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/support/two_breasts.h"

#include <cmath>

#include "tests/support/shapes.h"

namespace supine::testing {
namespace {

using reconstruction::Region;

constexpr double half_width_mm = 150, half_height_mm = 75, middle_mm = 75, foot_mm = 55, half_gap_mm = 10;

double thickness(const TwoBreasts& o, double x, double z) {
  const double from = std::hypot(std::abs(x) - middle_mm, z) / foot_mm;
  const double height = x > 0 ? o.left_height_mm : o.right_height_mm;
  return o.rim_thickness_mm + (from < 1 ? height * std::pow(1 - from * from, 1.5) : 0);
}

/// One box of x from low to high, bent into the mounds.
meshing::TetMesh piece(const TwoBreasts& o, double low, double high, int across) {
  const Eigen::Vector3d size(high - low, 2 * half_height_mm, 1);
  meshing::TetMesh mesh = box_mesh(across, o.up, o.deep, size);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    if (mesh.region[f] != static_cast<int>(Region::inner))
      mesh.region[f] =
          static_cast<int>((mesh.points(mesh.faces.row(f), 2).array() > 1 - 1e-9).all() ? Region::skin : Region::cut);
  for (auto row : mesh.points.rowwise()) {
    const double x = low + row.x(), z = row.y() - half_height_mm;
    row = Eigen::RowVector3d(x, -row.z() * thickness(o, x, z), z);
  }
  // The sheet of the box, laid under everything.
  for (auto row : mesh.muscle.points.rowwise()) {
    const double u = (row.x() + 20) / (size.x() + 40), v = (row.y() + 20) / (size.y() + 40);
    row = Eigen::RowVector3d((2 * u - 1) * (half_width_mm + 20), 0, (2 * v - 1) * (half_height_mm + 20));
  }
  return mesh;
}

template <class Rows>
Rows stacked(const Rows& a, const Rows& b) {
  Rows all(a.rows() + b.rows(), a.cols());
  all << a, b;
  return all;
}

}  // namespace

meshing::TetMesh two_breasts_mesh(const TwoBreasts& options) {
  if (!options.apart) return piece(options, -half_width_mm, half_width_mm, options.across);
  meshing::TetMesh mesh = piece(options, -half_width_mm, -half_gap_mm, options.across / 2);
  const meshing::TetMesh left = piece(options, half_gap_mm, half_width_mm, options.across / 2);
  const int points = static_cast<int>(mesh.points.rows()), cells = static_cast<int>(mesh.cells.rows());
  mesh.points = stacked(mesh.points, left.points);
  mesh.cells = stacked(mesh.cells, decltype(left.cells)(left.cells.array() + points));
  mesh.faces = stacked(mesh.faces, decltype(left.faces)(left.faces.array() + points));
  mesh.face_cell = stacked(mesh.face_cell, decltype(left.face_cell)(left.face_cell.array() + cells));
  mesh.region = stacked(mesh.region, left.region);
  mesh.tissue = stacked(mesh.tissue, left.tissue);
  mesh.fraction = stacked(mesh.fraction, left.fraction);
  return mesh;
}

}  // namespace supine::testing
