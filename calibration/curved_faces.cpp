// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/curved_faces.h"

#include <utility>

#include "meshing/tetrahedra/face_pieces.h"

namespace supine::calibration {

CurvedFaces::CurvedFaces(const Indices& faces) : faces_(faces) {
  meshing::CutFaces cut = meshing::cut_faces(faces);
  triangles_ = std::move(cut.triangles);
  weights_ = std::move(cut.weights);
}

void CurvedFaces::by_faces(ClosestPoints& closest) const {
  constexpr int pieces = meshing::FacePiece::per_face;
  const Table share = std::move(closest.weight);
  closest.node.resize(share.rows(), faces_.cols());
  closest.weight.resize(share.rows(), faces_.cols());
  for (Eigen::Index i = 0; i < share.rows(); ++i) {
    const int face = closest.triangle[i] / pieces;
    const meshing::FacePiece& piece = meshing::pieces_of_face()[static_cast<std::size_t>(closest.triangle[i] % pieces)];
    closest.node.row(i) = faces_.row(face);
    closest.weight.row(i) = share.row(i) * piece.shapes;
    closest.triangle[i] = 4 * face + piece.quarter;
  }
}

}  // namespace supine::calibration
