// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/face_pieces.h"

#include <array>
#include <map>
#include <vector>

#include "common/error.h"
#include "meshing/topology.h"

namespace supine::meshing {
namespace {

constexpr int pieces = 4;  // along an edge

/// Points of the boundary's faces, those on an edge once.
class Lattice {
 public:
  explicit Lattice(const TetMesh& mesh) : mesh_(mesh) {}

  /// @param i, j  steps from corner 0 toward corners 1 and 2 of face f, i + j <= pieces
  int point(Eigen::Index f, int i, int j) {
    const std::array<int, 3> steps{pieces - i - j, i, j};
    Key key{static_cast<int>(f), i, j, -1};
    for (int k = 0; k < 3; ++k) {
      const int from = mesh_.faces(f, (k + 1) % 3), to = mesh_.faces(f, (k + 2) % 3);
      const int at = steps[static_cast<std::size_t>((k + 2) % 3)];
      if (steps[static_cast<std::size_t>(k)] == 0)
        key = from < to ? Key{-1, from, to, at} : Key{-1, to, from, pieces - at};
    }
    for (int k = 0; k < 3; ++k)
      if (steps[static_cast<std::size_t>(k)] == pieces) key = {-1, mesh_.faces(f, k), -1, 0};
    const auto [place, added] = number_.try_emplace(key, static_cast<int>(points_.size()));
    if (added) points_.push_back(face_point(mesh_.points, mesh_.faces, f, double(i) / pieces, double(j) / pieces));
    return place->second;
  }

  Points points() const {
    Points all(static_cast<Eigen::Index>(points_.size()), 3);
    for (Eigen::Index p = 0; p < all.rows(); ++p) all.row(p) = points_[static_cast<std::size_t>(p)];
    return all;
  }

 private:
  using Key = std::array<int, 4>;  // of a point inside a face, on an edge, at a corner
  const TetMesh& mesh_;
  std::map<Key, int> number_;
  std::vector<Eigen::RowVector3d> points_;
};

}  // namespace

reconstruction::Surface face_pieces(const TetMesh& mesh) {
  if (mesh.order() != 2) throw InputError("only faces of quadratic tetrahedra are bent; this mesh is linear");
  Lattice lattice(mesh);
  reconstruction::Surface surface;
  surface.triangles.resize(pieces * pieces * mesh.faces.rows(), 3);
  surface.region.resize(surface.triangles.rows());
  Eigen::Index t = 0;
  const auto add = [&](Eigen::Index f, int a, int b, int c) {
    surface.triangles.row(t) << a, b, c;
    surface.region[t++] = mesh.region[f];
  };
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (int i = 0; i < pieces; ++i)
      for (int j = 0; i + j < pieces; ++j) {
        add(f, lattice.point(f, i, j), lattice.point(f, i + 1, j), lattice.point(f, i, j + 1));
        if (i + j + 1 < pieces)
          add(f, lattice.point(f, i + 1, j), lattice.point(f, i + 1, j + 1), lattice.point(f, i, j + 1));
      }
  surface.points = lattice.points();
  return surface;
}

}  // namespace supine::meshing
