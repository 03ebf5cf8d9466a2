// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/curved_faces.h"

#include <array>
#include <map>
#include <utility>

namespace supine::calibration {
namespace {

constexpr int parts = 4;  // of an edge; even, so that no triangle lies in two quarters
constexpr int pieces = parts * parts, nodes_of_face = 6;

using Thirds = std::array<int, 3>;  // barycentric coordinates, in parts

/// The quadratic shape functions of a triangle (Zienkiewicz, Taylor and Zhu, The finite element method, 7th ed., §6.2).
Eigen::RowVectorXd shape_functions(const Thirds& at) {
  const Eigen::Vector3d l = Eigen::Vector3d(at[0], at[1], at[2]) / parts;
  Eigen::RowVectorXd n(nodes_of_face);
  for (int a = 0; a < 3; ++a) n[a] = l[a] * (2 * l[a] - 1), n[3 + a] = 4 * l[a] * l[(a + 1) % 3];
  return n;
}

/// Corners of the small triangles of a face, counter-clockwise as the face.
std::vector<std::array<Thirds, 3>> cut_face() {
  std::vector<std::array<Thirds, 3>> all;
  const auto at = [](int i, int j) { return Thirds{parts - i - j, i, j}; };
  for (int j = 0; j < parts; ++j)
    for (int i = 0; i + j < parts; ++i) {
      all.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + j + 2 <= parts) all.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return all;
}

int quarter_of(const std::array<Thirds, 3>& piece) {
  for (int a = 0; a < 3; ++a)
    if (2 * std::min({piece[0][a], piece[1][a], piece[2][a]}) >= parts) return a;
  return 3;
}

struct Piece {
  std::array<Thirds, 3> corners;
  Eigen::Matrix<double, 3, nodes_of_face> shapes;  // at the corners
  int quarter;
};

const std::vector<Piece>& pieces_of_face() {
  static const std::vector<Piece> all = [] {
    std::vector<Piece> list;
    for (const auto& corners : cut_face()) {
      Piece piece{corners, {}, quarter_of(corners)};
      for (int k = 0; k < 3; ++k) piece.shapes.row(k) = shape_functions(corners[static_cast<std::size_t>(k)]);
      list.push_back(piece);
    }
    return list;
  }();
  return all;
}

/// A place of an edge has one name in both of its faces: the corners that take part, with their shares.
std::vector<std::pair<int, int>> name_of(const Thirds& at, const int* face) {
  std::vector<std::pair<int, int>> name;
  for (std::size_t a = 0; a < 3; ++a)
    if (at[a] > 0) name.emplace_back(face[a], at[a]);
  std::sort(name.begin(), name.end());
  return name;
}

}  // namespace

CurvedFaces::CurvedFaces(const Indices& faces) : faces_(faces), triangles_(pieces * faces.rows(), 3) {
  std::map<std::vector<std::pair<int, int>>, int> known;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index f = 0; f < faces.rows(); ++f)
    for (int p = 0; p < pieces; ++p) {
      const Piece& piece = pieces_of_face()[static_cast<std::size_t>(p)];
      for (int k = 0; k < 3; ++k) {
        const auto [at, added] = known.try_emplace(
            name_of(piece.corners[static_cast<std::size_t>(k)], faces.row(f).data()), static_cast<int>(known.size()));
        triangles_(pieces * f + p, k) = at->second;
        for (int a = 0; added && a < nodes_of_face; ++a)
          if (piece.shapes(k, a) != 0) entries.emplace_back(at->second, faces(f, a), piece.shapes(k, a));
      }
    }
  weights_.resize(static_cast<Eigen::Index>(known.size()), faces.maxCoeff() + 1);
  weights_.setFromTriplets(entries.begin(), entries.end());
}

void CurvedFaces::by_faces(ClosestPoints& closest) const {
  const Table share = std::move(closest.weight);
  closest.node.resize(share.rows(), nodes_of_face);
  closest.weight.resize(share.rows(), nodes_of_face);
  for (Eigen::Index i = 0; i < share.rows(); ++i) {
    const int face = closest.triangle[i] / pieces;
    const Piece& piece = pieces_of_face()[static_cast<std::size_t>(closest.triangle[i] % pieces)];
    closest.node.row(i) = faces_.row(face);
    closest.weight.row(i) = share.row(i) * piece.shapes;
    closest.triangle[i] = 4 * face + piece.quarter;
  }
}

}  // namespace supine::calibration
