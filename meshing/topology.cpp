// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/topology.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "common/error.h"

namespace supine::meshing {
namespace {

struct FaceUse {
  std::array<int, 3> key;  // sorted corners
  int cell;
  int opposite;
};

std::vector<FaceUse> sorted_uses(const Indices& cells) {
  std::vector<FaceUse> uses;
  uses.reserve(4 * cells.rows());
  for (int c = 0; c < cells.rows(); ++c) {
    for (int i = 0; i < 4; ++i) {
      FaceUse use{{cells(c, tet_faces[i][0]), cells(c, tet_faces[i][1]), cells(c, tet_faces[i][2])}, c, i};
      std::sort(use.key.begin(), use.key.end());
      uses.push_back(use);
    }
  }
  std::sort(uses.begin(), uses.end(),
            [](const FaceUse& a, const FaceUse& b) { return std::tie(a.key, a.cell) < std::tie(b.key, b.cell); });
  return uses;
}

// Local number of the node in the middle of the edge between corners a and b.
int middle_of(int a, int b) {
  for (int e = 0; e < 6; ++e) {
    if ((tet_edges[e][0] == a && tet_edges[e][1] == b) || (tet_edges[e][0] == b && tet_edges[e][1] == a)) return 4 + e;
  }
  return -1;
}

}  // namespace

Boundary boundary_of(const Indices& cells) {
  const std::vector<FaceUse> uses = sorted_uses(cells);
  std::vector<std::pair<int, int>> single;  // cell, opposite corner
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i + 1;
    while (end < uses.size() && uses[end].key == uses[i].key) ++end;
    if (end - i > 2) {
      throw InputError(fmt::format("tetrahedra {}, {} and {} share one face (points {}, {}, {}); two at most may",
                                   uses[i].cell, uses[i + 1].cell, uses[i + 2].cell, uses[i].key[0], uses[i].key[1],
                                   uses[i].key[2]));
    }
    if (end - i == 1) single.emplace_back(uses[i].cell, uses[i].opposite);
    i = end;
  }
  std::sort(single.begin(), single.end());
  const bool quadratic = cells.cols() == 10;
  Boundary boundary{Indices(single.size(), quadratic ? 6 : 3), Eigen::VectorXi(single.size())};
  for (std::size_t f = 0; f < single.size(); ++f) {
    const auto [cell, opposite] = single[f];
    const auto& corner = tet_faces[opposite];
    for (int k = 0; k < 3; ++k) {
      boundary.faces(f, k) = cells(cell, corner[k]);
      if (quadratic) boundary.faces(f, 3 + k) = cells(cell, middle_of(corner[k], corner[(k + 1) % 3]));
    }
    boundary.face_cell[f] = cell;
  }
  return boundary;
}

void set_face_cells(TetMesh& mesh) {
  const auto key = [](const Indices& faces, Eigen::Index f) {
    std::array<int, 3> corners = {faces(f, 0), faces(f, 1), faces(f, 2)};
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  std::map<std::array<int, 3>, int> owner;
  const Boundary boundary = boundary_of(mesh.cells);
  for (Eigen::Index f = 0; f < boundary.faces.rows(); ++f) owner[key(boundary.faces, f)] = boundary.face_cell[f];
  mesh.face_cell.resize(mesh.faces.rows());
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto found = owner.find(key(mesh.faces, f));
    mesh.face_cell[f] = found == owner.end() ? -1 : found->second;
  }
}

double cell_volume_mm3(const Points& points, const Indices& cells, Eigen::Index c) {
  const Eigen::RowVector3d a = points.row(cells(c, 0));
  const Eigen::RowVector3d u = points.row(cells(c, 1)) - a;
  const Eigen::RowVector3d v = points.row(cells(c, 2)) - a;
  const Eigen::RowVector3d w = points.row(cells(c, 3)) - a;
  return u.cross(v).dot(w) / 6;
}

Eigen::RowVector3d face_point(const Points& points, const Indices& faces, Eigen::Index f, double b, double c) {
  const double a = 1 - b - c;
  const auto node = [&](int k) { return points.row(faces(f, k)); };
  if (faces.cols() == 3) return a * node(0) + b * node(1) + c * node(2);
  return a * (2 * a - 1) * node(0) + b * (2 * b - 1) * node(1) + c * (2 * c - 1) * node(2) + 4 * a * b * node(3) +
         4 * b * c * node(4) + 4 * c * a * node(5);
}

double face_area_mm2(const Points& points, const Indices& faces, Eigen::Index f) {
  const Eigen::RowVector3d a = points.row(faces(f, 0));
  const Eigen::RowVector3d u = points.row(faces(f, 1)) - a;
  const Eigen::RowVector3d v = points.row(faces(f, 2)) - a;
  return u.cross(v).norm() / 2;
}

TetMesh to_quadratic(const TetMesh& mesh) {
  TetMesh out = mesh;
  std::map<std::pair<int, int>, int> middle;
  std::vector<Eigen::RowVector3d> added;
  const int corners = static_cast<int>(mesh.points.rows());
  const auto node = [&](int a, int b) {
    const auto [entry, is_new] = middle.try_emplace(std::minmax(a, b), corners + static_cast<int>(added.size()));
    if (is_new) added.push_back((mesh.points.row(a) + mesh.points.row(b)) / 2);
    return entry->second;
  };
  out.cells.resize(mesh.cells.rows(), 10);
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    out.cells.row(c).head(4) = mesh.cells.row(c);
    for (int e = 0; e < 6; ++e)
      out.cells(c, 4 + e) = node(mesh.cells(c, tet_edges[e][0]), mesh.cells(c, tet_edges[e][1]));
  }
  out.faces.resize(mesh.faces.rows(), 6);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    out.faces.row(f).head(3) = mesh.faces.row(f);
    for (int k = 0; k < 3; ++k) out.faces(f, 3 + k) = node(mesh.faces(f, k), mesh.faces(f, (k + 1) % 3));
  }
  out.points.conservativeResize(corners + static_cast<Eigen::Index>(added.size()), 3);
  for (std::size_t i = 0; i < added.size(); ++i) out.points.row(corners + static_cast<Eigen::Index>(i)) = added[i];
  return out;
}

}  // namespace supine::meshing
