// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/improve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "meshing/quality.h"
#include "meshing/topology.h"

namespace supine::meshing {
namespace {

constexpr int rounds = 12;

class Star {
 public:
  Star(TetMesh& mesh, const Triangles& walls)
      : mesh_(mesh), cells_(mesh.points.rows()), movable_(mesh.points.rows(), true) {
    for (int c = 0; c < mesh.cells.rows(); ++c) {
      for (int k = 0; k < 4; ++k) cells_[mesh.cells(c, k)].push_back(c);
    }
    for (Eigen::Index i = 0; i < mesh.faces.size(); ++i) movable_[mesh.faces.data()[i]] = false;
    for (Eigen::Index i = 0; i < walls.size(); ++i) movable_[walls.data()[i]] = false;
  }

  bool movable(int point) const { return movable_[point]; }

  double shape_of(int cell) const {
    Eigen::Matrix<double, 4, 3> x;
    for (int k = 0; k < 4; ++k) x.row(k) = mesh_.points.row(mesh_.cells(cell, k));
    return shape_angle_deg(x);
  }

  double worst_around(int point) const {
    double worst = 180;
    for (const int c : cells_[point]) worst = std::min(worst, shape_of(c));
    return worst;
  }

  // Pattern search: steps along the axes and towards the middle of the star, halved when none helps.
  void improve(int point) {
    double best = worst_around(point), step = 0.25 * size(point);
    for (int halving = 0; halving < 5;) {
      const Eigen::RowVector3d home = mesh_.points.row(point);
      Eigen::RowVector3d better = home;
      for (const Eigen::RowVector3d& direction : directions(point)) {
        mesh_.points.row(point) = home + step * direction;
        const double angle = worst_around(point);
        if (angle > best + 1e-6) {
          best = angle;
          better = mesh_.points.row(point);
        }
      }
      mesh_.points.row(point) = better;
      if (better == home) {
        step /= 2;
        ++halving;
      }
    }
  }

 private:
  double size(int point) const {
    double sum = 0;
    for (const int c : cells_[point]) sum += cell_volume_mm3(mesh_.points, mesh_.cells, c);
    return std::cbrt(6 * sum / static_cast<double>(cells_[point].size()));
  }

  std::array<Eigen::RowVector3d, 8> directions(int point) const {
    Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
    for (const int c : cells_[point]) {
      for (int k = 0; k < 4; ++k)
        middle += mesh_.points.row(mesh_.cells(c, k)) / (4.0 * static_cast<double>(cells_[point].size()));
    }
    const Eigen::RowVector3d to_middle = middle - mesh_.points.row(point);
    const Eigen::RowVector3d unit = to_middle.norm() > 0 ? Eigen::RowVector3d(to_middle.normalized()) : to_middle;
    const Eigen::RowVector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    return {x, -x, y, -y, z, -z, unit, -unit};
  }

  TetMesh& mesh_;
  std::vector<std::vector<int>> cells_;
  std::vector<bool> movable_;
};

}  // namespace

void move_points(TetMesh& mesh, double wanted_deg, const Triangles& walls) {
  Star star(mesh, walls);
  for (int round = 0; round < rounds; ++round) {
    std::vector<int> points;
    for (int c = 0; c < mesh.cells.rows(); ++c) {
      if (star.shape_of(c) >= wanted_deg) continue;
      for (int k = 0; k < 4; ++k) {
        if (star.movable(mesh.cells(c, k))) points.push_back(mesh.cells(c, k));
      }
    }
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    for (const int p : points) star.improve(p);
  }
}

}  // namespace supine::meshing
