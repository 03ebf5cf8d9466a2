// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "common/arrays.h"
#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// Corners of the face opposite to corner i of a tetrahedron, counter-clockwise seen from outside.
inline constexpr std::array<std::array<int, 3>, 4> tet_faces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

/// Edges in VTK order: the middle of edge e is node 4 + e of a quadratic tetrahedron.
inline constexpr std::array<std::array<int, 2>, 6> tet_edges = {{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};

/// The faces that belong to one cell only.
struct Boundary {
  Indices faces;              ///< #F by 3 or 6, node order of TetMesh::faces; ordered by cell, then by opposite corner
  Eigen::VectorXi face_cell;  ///< #F
};

/// @param cells  #C by 4 or 10
/// @throws InputError  naming the cells when three of them share a face
Boundary boundary_of(const Indices& cells);

/// Fills mesh.face_cell from cells and faces: the cell each face is on the boundary of, or -1.
/// @throws InputError  as boundary_of
void set_face_cells(TetMesh& mesh);

/// Signed volume of the corner tetrahedron of cell @p c, mm³; > 0 as TetMesh demands.
double cell_volume_mm3(const Points& points, const Indices& cells, Eigen::Index c);

/// Point of row @p f at barycentric coordinates (1 - b - c, b, c); on the curved face of a quadratic mesh.
Eigen::RowVector3d face_point(const Points& points, const Indices& faces, Eigen::Index f, double b, double c);

/// Area of the corner triangle of row @p f, mm².
double face_area_mm2(const Points& points, const Indices& faces, Eigen::Index f);

/// The same mesh with quadratic cells and faces: nodes in the middles of the straight edges, after the corners.
/// @pre  mesh.order() == 1
TetMesh to_quadratic(const TetMesh& mesh);

}  // namespace supine::meshing
