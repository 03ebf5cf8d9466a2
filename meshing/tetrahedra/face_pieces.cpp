// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/face_pieces.h"

#include <algorithm>
#include <map>
#include <utility>

#include "common/error.h"

namespace supine::meshing {
namespace {

constexpr int parts = 4;  // of an edge; even, so that no triangle lies in two quarters
constexpr int nodes_of_face = 6;

/// The quadratic shape functions of a triangle (Zienkiewicz, Taylor and Zhu, The finite element method, 7th ed., §6.2).
Eigen::RowVectorXd shape_functions(const FacePiece::Parts& at) {
  const Eigen::Vector3d l = Eigen::Vector3d(at[0], at[1], at[2]) / parts;
  Eigen::RowVectorXd n(nodes_of_face);
  for (int a = 0; a < 3; ++a) n[a] = l[a] * (2 * l[a] - 1), n[3 + a] = 4 * l[a] * l[(a + 1) % 3];
  return n;
}

/// Corners of the small triangles of a face, counter-clockwise as the face.
std::vector<std::array<FacePiece::Parts, 3>> cut_face() {
  std::vector<std::array<FacePiece::Parts, 3>> all;
  const auto at = [](int i, int j) { return FacePiece::Parts{parts - i - j, i, j}; };
  for (int i = 0; i < parts; ++i)
    for (int j = 0; i + j < parts; ++j) {
      all.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + j + 2 <= parts) all.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return all;
}

int quarter_of(const std::array<FacePiece::Parts, 3>& piece) {
  for (int a = 0; a < 3; ++a)
    if (2 * std::min({piece[0][a], piece[1][a], piece[2][a]}) >= parts) return a;
  return 3;
}

/// A place of an edge has one name in both of its faces: the corners that take part, with their shares.
std::vector<std::pair<int, int>> name_of(const FacePiece::Parts& at, const int* face) {
  std::vector<std::pair<int, int>> name;
  for (std::size_t a = 0; a < 3; ++a)
    if (at[a] > 0) name.emplace_back(face[a], at[a]);
  std::sort(name.begin(), name.end());
  return name;
}

}  // namespace

const std::vector<FacePiece>& pieces_of_face() {
  static const std::vector<FacePiece> all = [] {
    std::vector<FacePiece> list;
    for (const auto& corners : cut_face()) {
      FacePiece piece{corners, {}, quarter_of(corners)};
      for (int k = 0; k < 3; ++k) piece.shapes.row(k) = shape_functions(corners[static_cast<std::size_t>(k)]);
      list.push_back(piece);
    }
    return list;
  }();
  return all;
}

CutFaces cut_faces(const Indices& faces) {
  constexpr int pieces = FacePiece::per_face;
  CutFaces cut;
  cut.triangles.resize(pieces * faces.rows(), 3);
  std::map<std::vector<std::pair<int, int>>, int> known;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int p = 0; p < pieces; ++p) {
      const FacePiece& piece = pieces_of_face()[static_cast<std::size_t>(p)];
      for (int k = 0; k < 3; ++k) {
        const auto [at, added] = known.try_emplace(
            name_of(piece.corners[static_cast<std::size_t>(k)], faces.row(f).data()), static_cast<int>(known.size()));
        cut.triangles(pieces * f + p, k) = at->second;
        for (int a = 0; added && a < faces.cols(); ++a)
          if (piece.shapes(k, a) != 0) entries.emplace_back(at->second, faces(f, a), piece.shapes(k, a));
      }
    }
  cut.weights.resize(static_cast<Eigen::Index>(known.size()), faces.maxCoeff() + 1);
  cut.weights.setFromTriplets(entries.begin(), entries.end());
  return cut;
}

reconstruction::Surface face_pieces(const TetMesh& mesh) {
  if (mesh.order() != 2) throw InputError("only faces of quadratic tetrahedra are bent; this mesh is linear");
  const CutFaces cut = cut_faces(mesh.faces);
  Eigen::VectorXi region(cut.triangles.rows());
  for (Eigen::Index t = 0; t < region.size(); ++t) region[t] = mesh.region[t / FacePiece::per_face];
  return {cut.weights * mesh.points.topRows(cut.weights.cols()), cut.triangles, region};
}

}  // namespace supine::meshing
