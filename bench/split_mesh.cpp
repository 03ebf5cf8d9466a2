// SPDX-License-Identifier: AGPL-3.0-or-later
// Every quadratic tetrahedron of a mesh cut into eight, on the curved shape that it has: the same body, so that what
// another answer changes is the elements' alone.
//   bench_split_mesh MESH.vtu FINER.vtu
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <exception>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "common/error.h"
#include "meshing/mesh_io.h"
#include "meshing/topology.h"

using namespace supine;
using meshing::TetMesh;

namespace {

/// A node of the finer mesh: its parents' corners and their weights in quarters, the same from every cell that has it.
using Place = std::map<int, int>;

Place mean(const Place& a, const Place& b) {
  Place sum;
  for (const Place* one : {&a, &b})
    for (const auto& [corner, quarters] : *one) sum[corner] += quarters;
  for (auto& [corner, quarters] : sum) quarters /= 2;
  return sum;
}

class Splitter {
 public:
  explicit Splitter(const TetMesh& mesh) : mesh_(mesh) {
    for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c)
      for (int e = 0; e < 6; ++e) {
        const auto [a, b] = meshing::tet_edges[static_cast<std::size_t>(e)];
        middle_[std::minmax(mesh.cells(c, a), mesh.cells(c, b))] = mesh.cells(c, 4 + e);
      }
  }

  TetMesh split() {
    TetMesh finer = mesh_;
    const Eigen::Index cells = mesh_.cells.rows();
    finer.cells.resize(8 * cells, 10);
    finer.tissue.resize(8 * cells);
    finer.fraction.resize(8 * cells, mesh_.fraction.cols());
    finer.part_fraction.resize(8 * cells, mesh_.part_fraction.cols());
    for (Eigen::Index c = 0; c < cells; ++c) {
      const auto parts = parts_of(c);
      for (int k = 0; k < 8; ++k) {
        add_cell(parts[static_cast<std::size_t>(k)], finer.cells.row(8 * c + k));
        finer.tissue[8 * c + k] = mesh_.tissue[c];
        finer.fraction.row(8 * c + k) = mesh_.fraction.row(c);
        finer.part_fraction.row(8 * c + k) = mesh_.part_fraction.row(c);
      }
    }
    split_faces(finer);
    finer.points.resize(static_cast<Eigen::Index>(points_.size()), 3);
    for (std::size_t p = 0; p < points_.size(); ++p) finer.points.row(static_cast<Eigen::Index>(p)) = points_[p];
    meshing::set_face_cells(finer);
    return finer;
  }

 private:
  std::array<std::array<Place, 4>, 8> parts_of(Eigen::Index c) const {
    std::array<Place, 4> v;
    for (int i = 0; i < 4; ++i) v[static_cast<std::size_t>(i)] = {{mesh_.cells(c, i), 4}};
    const Place a = mean(v[0], v[1]), b = mean(v[1], v[2]), d = mean(v[0], v[2]), e = mean(v[0], v[3]),
                f = mean(v[1], v[3]), g = mean(v[2], v[3]);
    // The octahedron between the corners is cut along d-f.
    return {{{v[0], a, d, e},
             {a, v[1], b, f},
             {d, b, v[2], g},
             {e, f, g, v[3]},
             {d, f, b, a},
             {d, f, g, b},
             {d, f, e, g},
             {d, f, a, e}}};
  }

  void add_cell(std::array<Place, 4> corners, Eigen::Ref<Eigen::RowVectorXi> row) {
    Eigen::Matrix3d edges;
    for (int i = 0; i < 3; ++i) edges.row(i) = at(corners[static_cast<std::size_t>(i + 1)]) - at(corners[0]);
    if (edges.determinant() < 0) std::swap(corners[2], corners[3]);
    for (int i = 0; i < 4; ++i) row[i] = node(corners[static_cast<std::size_t>(i)]);
    for (int e = 0; e < 6; ++e) {
      const auto [a, b] = meshing::tet_edges[static_cast<std::size_t>(e)];
      row[4 + e] = node(mean(corners[static_cast<std::size_t>(a)], corners[static_cast<std::size_t>(b)]));
    }
  }

  void split_faces(TetMesh& finer) {
    const Eigen::Index faces = mesh_.faces.rows();
    finer.faces.resize(4 * faces, 6);
    finer.region.resize(4 * faces);
    for (Eigen::Index f = 0; f < faces; ++f) {
      std::array<Place, 3> v;
      for (int i = 0; i < 3; ++i) v[static_cast<std::size_t>(i)] = {{mesh_.faces(f, i), 4}};
      const Place a = mean(v[0], v[1]), b = mean(v[1], v[2]), c = mean(v[2], v[0]);
      const std::array<std::array<Place, 3>, 4> parts{{{v[0], a, c}, {a, v[1], b}, {c, b, v[2]}, {a, b, c}}};
      for (int k = 0; k < 4; ++k) {
        const auto& part = parts[static_cast<std::size_t>(k)];
        for (int i = 0; i < 3; ++i) {
          finer.faces(4 * f + k, i) = node(part[static_cast<std::size_t>(i)]);
          finer.faces(4 * f + k, 3 + i) =
              node(mean(part[static_cast<std::size_t>(i)], part[static_cast<std::size_t>((i + 1) % 3)]));
        }
        finer.region[4 * f + k] = mesh_.region[f];
      }
    }
  }

  /// By the quadratic shape functions of the corners that take part.
  Eigen::RowVector3d at(const Place& place) const {
    Eigen::RowVector3d x = Eigen::RowVector3d::Zero();
    for (auto a = place.begin(); a != place.end(); ++a) {
      const double share = a->second / 4.0;
      x += share * (2 * share - 1) * mesh_.points.row(a->first);
      for (auto b = std::next(a); b != place.end(); ++b)
        x += 4 * share * (b->second / 4.0) * mesh_.points.row(middle_.at({a->first, b->first}));
    }
    return x;
  }

  int node(const Place& place) {
    const auto [entry, added] = number_.emplace(place, static_cast<int>(points_.size()));
    if (added) points_.push_back(at(place));
    return entry->second;
  }

  const TetMesh& mesh_;
  std::map<std::pair<int, int>, int> middle_;
  std::map<Place, int> number_;
  std::vector<Eigen::RowVector3d> points_;
};

}  // namespace

int main(int count, char** words) {
  try {
    if (count != 3) throw InputError("bench_split_mesh MESH.vtu FINER.vtu");
    const TetMesh mesh = meshing::read_mesh(words[1]);
    if (mesh.order() != 2) throw InputError(fmt::format("{} has linear cells; quadratic ones are split", words[1]));
    const TetMesh finer = Splitter(mesh).split();
    meshing::write_mesh(finer, words[2], meshing::read_side(words[1]));
    fmt::print("{} to {} nodes, {} to {} cells\n", mesh.points.rows(), finer.points.rows(), mesh.cells.rows(),
               finer.cells.rows());
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_split_mesh: error: {}\n", error.what());
    return 2;
  }
  return 0;
}
