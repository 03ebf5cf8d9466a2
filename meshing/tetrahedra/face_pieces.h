// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "meshing/tet_mesh.h"
#include "reconstruction/surface.h"

namespace supine::meshing {

/// One of the flat triangles that a quadratic face is cut into.
struct FacePiece {
  static constexpr int per_face = 16;
  using Parts = std::array<int, 3>;    ///< barycentric coordinates in the face, in quarters
  std::array<Parts, 3> corners;        ///< counter-clockwise as the face
  Eigen::Matrix<double, 3, 6> shapes;  ///< shape functions of the face's nodes at the corners
  int quarter;                         ///< 0 to 2 at that corner of the face, 3 in its middle
};
const std::vector<FacePiece>& pieces_of_face();

/// Quadratic faces in pieces, those of a face together and in order.
struct CutFaces {
  Triangles triangles;                                   ///< rows of corners; one on an edge is the same in both faces
  Eigen::SparseMatrix<double, Eigen::RowMajor> weights;  ///< #corners by nodes: places of corners = weights · nodes
};
/// @param faces  #F by 6, nodes: corners, then the middles of 01, 12 and 20
CutFaces cut_faces(const Indices& faces);

/// The boundary of a quadratic mesh, every face in 16 flat triangles with their corners on the face, bent as it is:
/// what another mesh of the same body can be bent onto (curve_boundary).
/// @return closed where the boundary is, with the faces' regions; mm, LPS
/// @throws InputError  mesh is linear
reconstruction::Surface face_pieces(const TetMesh& mesh);

}  // namespace supine::meshing
