// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/size_field.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/error.h"
#include "meshing/topology.h"

namespace supine::meshing {
namespace {

constexpr double smallest_factor = 0.25, largest_factor = 1.5;  // of the edges there are
constexpr double growth = 0.3;                                  // of an edge length per mm
constexpr double most_nodes = 60000;                            // of the grid
constexpr double margin = 2;                                    // spacings round the body

struct Solved {
  Eigen::VectorXd edge_mm, error, volume_mm3;  // by cell
};

// Gradient of the displacement of the corner tetrahedron; dx/dX − 1.
Eigen::Matrix3d gradient(const PoseMesh& pose, Eigen::Index c) {
  Eigen::Matrix3d from, moved;
  const auto node = [&](int k) { return pose.mesh.cells(c, k); };
  for (int k = 0; k < 3; ++k) {
    from.col(k) = (pose.mesh.points.row(node(k + 1)) - pose.mesh.points.row(node(0))).transpose();
    moved.col(k) = (pose.positions.row(node(k + 1)) - pose.positions.row(node(0))).transpose();
  }
  return moved * from.inverse() - Eigen::Matrix3d::Identity();
}

Solved errors_of(const PoseMesh& pose) {
  const Eigen::Index count = pose.mesh.cells.rows();
  Solved solved{Eigen::VectorXd(count), Eigen::VectorXd(count), Eigen::VectorXd(count)};
  std::vector<Eigen::Matrix3d> cell(count), node(pose.mesh.points.rows(), Eigen::Matrix3d::Zero());
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(pose.mesh.points.rows());
  for (Eigen::Index c = 0; c < count; ++c) {
    cell[c] = gradient(pose, c);
    solved.volume_mm3[c] = cell_volume_mm3(pose.mesh.points, pose.mesh.cells, c);
    // Of the regular tetrahedron of that volume.
    solved.edge_mm[c] = std::cbrt(6 * std::sqrt(2.0) * solved.volume_mm3[c]);
    for (int k = 0; k < 4; ++k) {
      node[pose.mesh.cells(c, k)] += solved.volume_mm3[c] * cell[c];
      weight[pose.mesh.cells(c, k)] += solved.volume_mm3[c];
    }
  }
  for (Eigen::Index c = 0; c < count; ++c) {
    Eigen::Matrix3d recovered = Eigen::Matrix3d::Zero();
    for (int k = 0; k < 4; ++k) recovered += node[pose.mesh.cells(c, k)] / (4 * weight[pose.mesh.cells(c, k)]);
    solved.error[c] = (recovered - cell[c]).norm();
  }
  return solved;
}

Eigen::VectorXd wanted_edges(const Solved& solved, double common) {
  Eigen::VectorXd edges = solved.edge_mm;
  for (Eigen::Index c = 0; c < edges.size(); ++c)
    edges[c] *= std::clamp(common / std::max(solved.error[c], 1e-12), smallest_factor, largest_factor);
  return edges;
}

// The common error at which the cells' volumes hold so many tetrahedra; more cells than the factors allow: all shrink.
Eigen::VectorXd edges_for(const Solved& solved, std::size_t cells) {
  const auto held = [&solved](const Eigen::VectorXd& edges) {
    return (solved.volume_mm3.array() * 6 * std::sqrt(2.0) / edges.array().cube()).sum();
  };
  double low = 1e-9, high = 1e9;
  for (int step = 0; step < 100; ++step) {
    const double middle = std::sqrt(low * high);
    (held(wanted_edges(solved, middle)) > static_cast<double>(cells) ? low : high) = middle;
  }
  const Eigen::VectorXd edges = wanted_edges(solved, std::sqrt(low * high));
  return edges * std::cbrt(held(edges) / static_cast<double>(cells));
}

// By node: the volume-weighted geometric mean of its cells, then no more than what neighbours allow.
Eigen::VectorXd at_nodes(const PoseMesh& pose, const Solved& solved, const Eigen::VectorXd& edges) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(pose.mesh.points.rows()), weight = sum;
  for (Eigen::Index c = 0; c < edges.size(); ++c)
    for (int k = 0; k < 4; ++k) {
      sum[pose.mesh.cells(c, k)] += solved.volume_mm3[c] * std::log(edges[c]);
      weight[pose.mesh.cells(c, k)] += solved.volume_mm3[c];
    }
  Eigen::VectorXd size(sum.size());
  for (Eigen::Index p = 0; p < size.size(); ++p) size[p] = weight[p] > 0 ? std::exp(sum[p] / weight[p]) : 0;
  for (bool changed = true; changed;) {
    changed = false;
    for (Eigen::Index c = 0; c < edges.size(); ++c)
      for (const auto& [i, j] : tet_edges) {
        const int a = pose.mesh.cells(c, i), b = pose.mesh.cells(c, j);
        const double most = growth * (pose.mesh.points.row(a) - pose.mesh.points.row(b)).norm();
        for (const auto& [p, q] : {std::pair{a, b}, std::pair{b, a}})
          if (size[p] > size[q] + most + 1e-9) {
            size[p] = size[q] + most;
            changed = true;
          }
      }
  }
  return size;
}

SizeField empty_grid(const PoseMesh& pose, double spacing_mm) {
  const Eigen::Vector3d low = pose.mesh.points.colwise().minCoeff(), high = pose.mesh.points.colwise().maxCoeff();
  const double volume = (high - low).prod();
  SizeField field;
  field.spacing_mm = std::max(spacing_mm, std::cbrt(volume / most_nodes));
  field.origin_mm = low.array() - margin * field.spacing_mm;
  field.count = ((high - low).array() / field.spacing_mm + 2 * margin + 2).cast<int>();
  field.size_mm = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(field.count.x()) * field.count.y() * field.count.z());
  return field;
}

// Nodes without a value take the mean of their neighbours', layer by layer.
void spread(SizeField& field) {
  const auto neighbours = [&field](int x, int y, int z, double& sum, int& count) {
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        Eigen::Vector3i at(x, y, z);
        at[axis] += step;
        if (at[axis] < 0 || at[axis] >= field.count[axis]) continue;
        const double size = field.size_mm[field.node(at.x(), at.y(), at.z())];
        if (!(size > 0)) continue;
        sum += size;
        ++count;
      }
  };
  for (bool missing = true; missing;) {
    missing = false;
    Eigen::VectorXd next = field.size_mm;
    for (int z = 0; z < field.count.z(); ++z)
      for (int y = 0; y < field.count.y(); ++y)
        for (int x = 0; x < field.count.x(); ++x) {
          if (field.size_mm[field.node(x, y, z)] > 0) continue;
          double sum = 0;
          int count = 0;
          neighbours(x, y, z, sum, count);
          if (count > 0) next[field.node(x, y, z)] = sum / count;
          missing = true;
        }
    field.size_mm = next;
  }
}

// Each cell writes its interpolated sizes onto the grid nodes in it and next to it; the smallest holds.
void paint(const PoseMesh& pose, const Eigen::VectorXd& size, SizeField& field) {
  for (Eigen::Index c = 0; c < pose.mesh.cells.rows(); ++c) {
    Eigen::AlignedBox3d box;
    Eigen::Matrix3d edges;
    const Eigen::Vector3d first = pose.mesh.points.row(pose.mesh.cells(c, 0)).transpose();
    for (int k = 0; k < 4; ++k) box.extend(Eigen::Vector3d(pose.mesh.points.row(pose.mesh.cells(c, k)).transpose()));
    for (int k = 0; k < 3; ++k) edges.col(k) = pose.mesh.points.row(pose.mesh.cells(c, k + 1)).transpose() - first;
    const Eigen::Matrix3d inverse = edges.inverse();
    const Eigen::Vector3i low = ((box.min() - field.origin_mm) / field.spacing_mm).array().floor().cast<int>();
    const Eigen::Vector3i high = ((box.max() - field.origin_mm) / field.spacing_mm).array().ceil().cast<int>();
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x) {
          const Eigen::Vector3d inside = (inverse * (field.place(x, y, z) - first)).cwiseMax(0).cwiseMin(1);
          const double total = std::max(1.0, inside.sum());
          double value = std::max(0.0, 1 - inside.sum()) * size[pose.mesh.cells(c, 0)];
          for (int k = 0; k < 3; ++k) value += inside[k] / total * size[pose.mesh.cells(c, k + 1)];
          double& known = field.size_mm[field.node(x, y, z)];
          known = known > 0 ? std::min(known, value) : value;
        }
  }
}

}  // namespace

double SizeField::at(const Eigen::Vector3d& where) const {
  const Eigen::Vector3d most = (count.array() - 1).cast<double>();
  const Eigen::Vector3d index = ((where - origin_mm) / spacing_mm).cwiseMax(0).cwiseMin(most);
  const Eigen::Vector3i low = index.cast<int>().cwiseMin((count.array() - 2).matrix());
  const Eigen::Vector3d share = index - low.cast<double>();
  double value = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i step(corner & 1, corner >> 1 & 1, corner >> 2);
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) weight *= step[axis] ? share[axis] : 1 - share[axis];
    value += weight * size_mm[node(low.x() + step.x(), low.y() + step.y(), low.z() + step.z())];
  }
  return value;
}

SizeField sizes_from_pose(const PoseMesh& pose, std::size_t cells) {
  if (cells < 10) throw InputError(fmt::format("{} tetrahedra are asked for; at least 10 are needed", cells));
  const Solved solved = errors_of(pose);
  const Eigen::VectorXd size = at_nodes(pose, solved, edges_for(solved, cells));
  double smallest = std::numeric_limits<double>::infinity();
  for (const double s : size)
    if (s > 0) smallest = std::min(smallest, s);
  SizeField field = empty_grid(pose, smallest);
  paint(pose, size, field);
  spread(field);
  return field;
}

}  // namespace supine::meshing
