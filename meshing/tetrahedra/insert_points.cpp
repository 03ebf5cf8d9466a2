// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "meshing/quality.h"
#include "meshing/tetrahedra/improve.h"
#include "meshing/topology.h"

namespace supine::meshing {
namespace {

using Tet = std::array<int, 4>;
using Face = std::array<int, 3>;  // corners counter-clockwise seen from outside
using Point = Eigen::RowVector3d;

constexpr int rounds = 4;
constexpr double least_gain_deg = 1;

Face sorted(Face f) {
  std::sort(f.begin(), f.end());
  return f;
}

Face face_of(const Tet& tet, int opposite) {
  const auto& f = tet_faces[opposite];
  return {tet[f[0]], tet[f[1]], tet[f[2]]};
}

/// A set of tetrahedra to be replaced by the star of one point: a tetrahedron from it to each face of the shell.
struct Cavity {
  std::vector<int> cells;
  std::vector<Face> shell;  // faces of one of the cells only
  double worst_deg = 180;   // of the cells as they are
};

struct Star {
  Cavity cavity;
  Point centre;
  double worst_deg;
};

/// Points are added where the star of the best one is better shaped than the cavity it fills.
class PointInsertion {
 public:
  PointInsertion(const TetMesh& mesh, const Triangles& walls) : points_(mesh.points.rows()), tets_(mesh.cells.rows()) {
    for (Eigen::Index t = 0; t < walls.rows(); ++t) walls_.insert(sorted({walls(t, 0), walls(t, 1), walls(t, 2)}));
    for (Eigen::Index p = 0; p < mesh.points.rows(); ++p) points_[p] = mesh.points.row(p);
    for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
      for (int k = 0; k < 4; ++k) tets_[c][k] = mesh.cells(c, k);
    }
  }

  /// One pass over the bad tetrahedra, worst first; cavities of one pass do not touch. @return points added
  int pass(double wanted_deg) {
    index();
    std::vector<std::pair<double, int>> bad;
    for (int c = 0; c < static_cast<int>(tets_.size()); ++c) {
      const double shape = shape_of(tets_[c]);
      if (shape < wanted_deg) bad.emplace_back(shape, c);
    }
    std::sort(bad.begin(), bad.end());
    std::vector<char> used(tets_.size(), 0);
    std::vector<Tet> added;
    int count = 0;
    for (const auto& [shape, cell] : bad) {
      const std::optional<Star> star = best_star(cell, used);
      if (!star) continue;
      for (const int c : star->cavity.cells) used[c] = 1;
      const int centre = static_cast<int>(points_.size());
      points_.push_back(star->centre);
      for (const Face& f : star->cavity.shell) added.push_back({f[0], f[2], f[1], centre});
      ++count;
    }
    std::vector<Tet> kept;
    for (std::size_t c = 0; c < tets_.size(); ++c) {
      if (!used[c]) kept.push_back(tets_[c]);
    }
    kept.insert(kept.end(), added.begin(), added.end());
    tets_ = std::move(kept);
    return count;
  }

  void store(TetMesh& mesh) const {
    mesh.points.resize(static_cast<Eigen::Index>(points_.size()), 3);
    for (std::size_t p = 0; p < points_.size(); ++p) mesh.points.row(static_cast<Eigen::Index>(p)) = points_[p];
    mesh.cells.resize(static_cast<Eigen::Index>(tets_.size()), 4);
    for (std::size_t c = 0; c < tets_.size(); ++c) {
      for (int k = 0; k < 4; ++k) mesh.cells(static_cast<Eigen::Index>(c), k) = tets_[c][k];
    }
  }

 private:
  double shape_of(const Tet& tet) const {
    Eigen::Matrix<double, 4, 3> x;
    for (int k = 0; k < 4; ++k) x.row(k) = points_[tet[k]];
    return shape_angle_deg(x);
  }

  double shape_to(const Face& f, const Point& p) const {
    Eigen::Matrix<double, 4, 3> x;
    x << points_[f[0]], points_[f[2]], points_[f[1]], p;
    return shape_angle_deg(x);
  }

  void index() {
    cells_of_point_.assign(points_.size(), {});
    for (int c = 0; c < static_cast<int>(tets_.size()); ++c) {
      for (const int p : tets_[c]) cells_of_point_[p].push_back(c);
    }
  }

  // Cells that have all the given points.
  std::vector<int> cells_with(std::initializer_list<int> corners) const {
    std::vector<int> found;
    for (const int c : cells_of_point_[*corners.begin()]) {
      const Tet& t = tets_[c];
      if (std::all_of(corners.begin(), corners.end(),
                      [&](int p) { return std::find(t.begin(), t.end(), p) != t.end(); })) {
        found.push_back(c);
      }
    }
    return found;
  }

  // The cell with those across its faces; the cells around each of its edges; and all of these together.
  std::vector<std::set<int>> candidates(int cell) const {
    const Tet& t = tets_[cell];
    std::set<int> across, around;
    std::vector<std::set<int>> sets;
    for (int i = 0; i < 4; ++i) {
      const Face f = face_of(t, i);
      for (const int c : cells_with({f[0], f[1], f[2]})) across.insert(c);
    }
    for (const auto& [a, b] : tet_edges) {
      const std::vector<int> star = cells_with({t[a], t[b]});
      sets.emplace_back(star.begin(), star.end());
      around.insert(star.begin(), star.end());
    }
    sets.push_back(across);
    sets.push_back(around);
    return sets;
  }

  std::optional<Cavity> cavity_of(const std::set<int>& cells, const std::vector<char>& used) const {
    Cavity cavity;
    std::map<Face, std::pair<int, Face>> faces;
    std::set<int> corners, shell_corners;
    for (const int c : cells) {
      if (used[c]) return std::nullopt;
      cavity.cells.push_back(c);
      cavity.worst_deg = std::min(cavity.worst_deg, shape_of(tets_[c]));
      corners.insert(tets_[c].begin(), tets_[c].end());
      for (int i = 0; i < 4; ++i) {
        const Face f = face_of(tets_[c], i);
        auto& [count, face] = faces[sorted(f)];
        ++count;
        face = f;
      }
    }
    for (const auto& [key, entry] : faces) {
      if (entry.first > 1) {
        if (walls_.contains(key)) return std::nullopt;
        continue;
      }
      cavity.shell.push_back(entry.second);
      shell_corners.insert(key.begin(), key.end());
    }
    if (corners != shell_corners) return std::nullopt;  // a point inside would be lost
    return cavity;
  }

  // Pattern search for the centre from which the worst tetrahedron to the shell is best.
  Star star_of(const Cavity& cavity) const {
    Point centre = Point::Zero();
    double reach = 0;
    for (const Face& f : cavity.shell) {
      for (const int p : f) centre += points_[p] / (3.0 * static_cast<double>(cavity.shell.size()));
    }
    for (const Face& f : cavity.shell) reach = std::max(reach, (points_[f[0]] - centre).norm());
    const auto worst = [&](const Point& p) {
      double low = 180;
      for (const Face& f : cavity.shell) low = std::min(low, shape_to(f, p));
      return low;
    };
    double best = worst(centre);
    for (double step = 0.4 * reach; step > 0.01 * reach;) {
      Point better = centre;
      for (int d = 0; d < 26; ++d) {
        const int n = d < 13 ? d : d + 1;  // the 26 neighbours of a cube in a block of 27
        const Point p = centre + step * Point(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1).normalized();
        const double value = worst(p);
        if (value > best) {
          best = value;
          better = p;
        }
      }
      if (better == centre) step /= 2;
      centre = better;
    }
    return {cavity, centre, best};
  }

  std::optional<Star> best_star(int cell, const std::vector<char>& used) const {
    if (used[cell]) return std::nullopt;
    std::optional<Star> best;
    for (const std::set<int>& cells : candidates(cell)) {
      const std::optional<Cavity> cavity = cavity_of(cells, used);
      if (!cavity) continue;
      Star star = star_of(*cavity);
      if (star.worst_deg > cavity->worst_deg + least_gain_deg && (!best || star.worst_deg > best->worst_deg))
        best = std::move(star);
    }
    return best;
  }

  std::vector<Point> points_;
  std::vector<Tet> tets_;
  std::set<Face> walls_;
  std::vector<std::vector<int>> cells_of_point_;
};

}  // namespace

int insert_points(TetMesh& mesh, double wanted_deg, const Triangles& walls) {
  PointInsertion insertion(mesh, walls);
  int added = 0;
  for (int round = 0; round < rounds; ++round) {
    const int now = insertion.pass(wanted_deg);
    added += now;
    if (now == 0) break;
  }
  if (added == 0) return 0;
  insertion.store(mesh);
  set_face_cells(mesh);
  return added;
}

}  // namespace supine::meshing
