// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>

#include "meshing/mesh_io.h"
#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// Edge lengths wanted in space: values at the nodes of a regular grid, linear between them along each axis, and those
/// of the rim outside.
struct SizeField {
  Eigen::Vector3d origin_mm;
  double spacing_mm;
  Eigen::Vector3i count;    ///< nodes along x, y, z
  Eigen::VectorXd size_mm;  ///< by node, x fastest

  double at(const Eigen::Vector3d& place) const;
  Eigen::Index node(int x, int y, int z) const {
    return x + count.x() * (y + static_cast<Eigen::Index>(count.y()) * z);
  }
  Eigen::Vector3d place(int x, int y, int z) const { return origin_mm + spacing_mm * Eigen::Vector3d(x, y, z); }
};

/// Edge lengths for about @p cells tetrahedra that share the error of a solved pose equally.
///
/// The error of a cell is how far the gradient of its displacement is from the one averaged at its corners
/// (Zienkiewicz and Zhu 1987: recovered minus computed gradient, Frobenius norm, at the cell's centroid). For linear
/// cells it falls with the edge length, so a cell wants its edge times (common error / its error), between a quarter
/// and one and a half; edges grow by at most 0.3 per mm.
/// @param pose   a pose on a mesh of the same body, linear or quadratic
/// @param cells  >= 10
/// @throws InputError  cells too few
SizeField sizes_from_pose(const PoseMesh& pose, std::size_t cells);

}  // namespace supine::meshing
