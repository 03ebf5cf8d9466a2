// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/mesh_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "common/error.h"
#include "meshing/jacobian.h"
#include "meshing/topology.h"
#include "segmentation/tissue.h"

namespace supine::meshing {
namespace {

std::string place(const TetMesh& mesh, const Eigen::RowVectorXi& nodes, int corners) {
  Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
  for (int i = 0; i < corners; ++i) centre += mesh.points.row(nodes[i]) / corners;
  return fmt::format("at ({:.2f}, {:.2f}, {:.2f}) mm", centre.x(), centre.y(), centre.z());
}

void check_indices(const Indices& rows, Eigen::Index points, const char* what) {
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    for (Eigen::Index k = 0; k < rows.cols(); ++k) {
      if (rows(r, k) < 0 || rows(r, k) >= points) {
        throw InputError(
            fmt::format("{} {} names point {}; the mesh has points 0 to {}", what, r, rows(r, k), points - 1));
      }
    }
  }
}

void check_cells(const TetMesh& mesh) {
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const double volume = cell_volume_mm3(mesh.points, mesh.cells, c);
    if (!(volume > 0)) {
      throw InputError(fmt::format(
          "tetrahedron {} {} has a volume of {:.6g} mm³; it must be positive (inverted or flat: mesh again)", c,
          place(mesh, mesh.cells.row(c), 4), volume));
    }
    if (mesh.order() == 2 && !scaled_jacobian_exceeds(quadratic_nodes(mesh, c), 0)) {
      throw InputError(fmt::format(
          "tetrahedron {} {} is turned inside out somewhere by its curved edges: its smallest Jacobian is {:.3g} of "
          "the straight one's, and must be positive (mesh again)",
          c, place(mesh, mesh.cells.row(c), 4), smallest_scaled_jacobian(quadratic_nodes(mesh, c)).high));
    }
    const int tissue = mesh.tissue[c];
    if (tissue < 0 || tissue >= segmentation::tissue_count ||
        !segmentation::is_meshed(static_cast<segmentation::Tissue>(tissue))) {
      throw InputError(fmt::format("tetrahedron {} {} has tissue {}, which is not one that is meshed", c,
                                   place(mesh, mesh.cells.row(c), 4), tissue));
    }
    const double sum = mesh.fraction.row(c).sum();
    if (!(std::abs(sum - 1) <= 1e-6) || (mesh.fraction.row(c).array() < 0).any()) {
      throw InputError(
          fmt::format("tetrahedron {} {}: its tissue fractions sum to {:.8g} instead of 1, or one is negative", c,
                      place(mesh, mesh.cells.row(c), 4), sum));
    }
  }
}

// Corners with the smallest first, the cyclic order kept.
std::array<int, 3> turned(const Indices& faces, Eigen::Index f) {
  std::array<int, 3> t = {faces(f, 0), faces(f, 1), faces(f, 2)};
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

void check_faces(const TetMesh& mesh) {
  const Boundary boundary = boundary_of(mesh.cells);
  std::vector<std::pair<std::array<int, 3>, int>> wanted;
  for (Eigen::Index f = 0; f < boundary.faces.rows(); ++f)
    wanted.emplace_back(turned(boundary.faces, f), boundary.face_cell[f]);
  std::sort(wanted.begin(), wanted.end());
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const std::pair<std::array<int, 3>, int> face{turned(mesh.faces, f), mesh.face_cell[f]};
    if (!std::binary_search(wanted.begin(), wanted.end(), face)) {
      throw InputError(fmt::format("triangle {} {} is not on the boundary of tetrahedron {}, seen from outside", f,
                                   place(mesh, mesh.faces.row(f), 3), mesh.face_cell[f]));
    }
    if (mesh.region[f] < 1 || mesh.region[f] > 4) {
      throw InputError(fmt::format("triangle {} {} has region {}; inner 1, skin 2, ligament 3 or cut 4 is expected", f,
                                   place(mesh, mesh.faces.row(f), 3), mesh.region[f]));
    }
  }
  if (mesh.faces.rows() != boundary.faces.rows()) {
    throw InputError(fmt::format("the mesh lists {} boundary triangles, its tetrahedra have {}", mesh.faces.rows(),
                                 boundary.faces.rows()));
  }
}

}  // namespace

void check_mesh(const TetMesh& mesh) {
  if (mesh.cells.rows() == 0) throw InputError("the mesh has no tetrahedra");
  const bool quadratic = mesh.cells.cols() == 10;
  if ((mesh.cells.cols() != 4 && !quadratic) || mesh.faces.cols() != (quadratic ? 6 : 3)) {
    throw InputError(
        fmt::format("the mesh has {} nodes per tetrahedron and {} per triangle; 4 and 3, or 10 and 6, are expected",
                    mesh.cells.cols(), mesh.faces.cols()));
  }
  if (mesh.tissue.size() != mesh.cells.rows() || mesh.fraction.rows() != mesh.cells.rows() ||
      mesh.region.size() != mesh.faces.rows() || mesh.face_cell.size() != mesh.faces.rows()) {
    throw InputError("the mesh has tissues, fractions or regions for another number of cells than it has");
  }
  if (!mesh.points.allFinite()) throw InputError("the mesh has a point whose coordinates are not finite numbers");
  check_indices(mesh.cells, mesh.points.rows(), "tetrahedron");
  check_indices(mesh.faces, mesh.points.rows(), "triangle");
  check_cells(mesh);
  check_faces(mesh);
}

}  // namespace supine::meshing
