// SPDX-License-Identifier: AGPL-3.0-or-later
// Surfaces without regions for tests of decimation.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <tuple>
#include <vector>

#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface.h"

namespace supine::testing {

using reconstruction::Surface;

using Map = std::function<Eigen::Vector3d(double, double)>;

// A grid of nu × nv cells over [0, 1]², each cut in two; wrapped where it closes.
inline Surface grid(int nu, int nv, bool wrap_u, bool wrap_v, const Map& map) {
  const int pu = wrap_u ? nu : nu + 1, pv = wrap_v ? nv : nv + 1;
  Surface s;
  s.points.resize(pu * pv, 3);
  for (int i = 0; i < pu; ++i)
    for (int j = 0; j < pv; ++j)
      s.points.row(i * pv + j) = map(static_cast<double>(i) / nu, static_cast<double>(j) / nv).transpose();
  s.triangles.resize(2 * nu * nv, 3);
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const int a = i * pv + j, b = (i + 1) % pu * pv + j, c = (i + 1) % pu * pv + (j + 1) % pv,
                d = i * pv + (j + 1) % pv;
      s.triangles.row(2 * (i * nv + j)) << a, b, c;
      s.triangles.row(2 * (i * nv + j) + 1) << a, c, d;
    }
  return s;
}

inline Surface open_sheet() {
  return grid(12, 9, false, false, [](double u, double v) { return Eigen::Vector3d(12 * u, 9 * v, 0); });
}

inline Surface torus(double ring_mm, double tube_mm) {
  return grid(96, 40, true, true, [=](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
    const double r = ring_mm + tube_mm * std::cos(b);
    return Eigen::Vector3d(r * std::cos(a), r * std::sin(a), tube_mm * std::sin(b));
  });
}

// Boundary of a set of voxels; every step stays a step.
inline Surface voxels(int nx, int ny, int nz, double voxel_mm, const std::function<bool(int, int, int)>& inside) {
  std::map<std::tuple<int, int, int>, int> numbers;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3i> triangles;
  const auto at = [&](int x, int y, int z) {
    const auto [entry, fresh] = numbers.emplace(std::tuple(x, y, z), static_cast<int>(points.size()));
    if (fresh) points.emplace_back(voxel_mm * x, voxel_mm * y, voxel_mm * z);
    return entry->second;
  };
  const auto filled = [&](int x, int y, int z) {
    return x >= 0 && y >= 0 && z >= 0 && x < nx && y < ny && z < nz && inside(x, y, z);
  };
  for (int x = 0; x < nx; ++x)
    for (int y = 0; y < ny; ++y)
      for (int z = 0; z < nz; ++z) {
        if (!filled(x, y, z)) continue;
        for (int axis = 0; axis < 3; ++axis)
          for (const int side : {0, 1}) {
            Eigen::Vector3i n = Eigen::Vector3i::Zero();
            n[axis] = side ? 1 : -1;
            if (filled(x + n[0], y + n[1], z + n[2])) continue;
            Eigen::Vector3i u = Eigen::Vector3i::Zero(), v = u, base(x, y, z);
            u[(axis + 1) % 3] = 1;
            v[(axis + 2) % 3] = 1;
            if (side) base[axis] += 1;
            const auto corner = [&](const Eigen::Vector3i& p) { return at(p[0], p[1], p[2]); };
            int a = corner(base), b = corner(base + u), c = corner(base + u + v), d = corner(base + v);
            if (!side) std::swap(b, d);
            triangles.emplace_back(a, b, c);
            triangles.emplace_back(a, c, d);
          }
      }
  Surface s;
  s.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  s.triangles.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) s.points.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  for (std::size_t i = 0; i < triangles.size(); ++i)
    s.triangles.row(static_cast<Eigen::Index>(i)) = triangles[i].transpose();
  return s;
}

// An ellipsoid with uneven bumps: nothing about it is symmetric.
inline Surface lump() {
  Surface s = voxels(24, 20, 18, 2, [](int x, int y, int z) {
    const Eigen::Vector3d at(x - 11.6, y - 9.3, z - 8.4);
    return at.cwiseQuotient(Eigen::Vector3d(11, 8.6, 7.7)).squaredNorm() < 1;
  });
  const auto neighbours = reconstruction::point_neighbours(reconstruction::mesh_edges(s.triangles), s.points.rows());
  for (int round = 0; round < 12; ++round) {
    Points next = s.points;
    for (Eigen::Index p = 0; p < next.rows(); ++p) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (const int q : neighbours[p]) sum += s.points.row(q);
      next.row(p) = sum / static_cast<double>(neighbours[p].size());
    }
    s.points = next;
  }
  for (Eigen::Index p = 0; p < s.points.rows(); ++p) {
    const Eigen::RowVector3d at = s.points.row(p);
    s.points.row(p) +=
        0.8 * Eigen::RowVector3d(std::sin(0.31 * at.y() + 0.2), std::cos(0.23 * at.z()), std::sin(0.17 * at.x() + 1));
  }
  return s;
}

/// Both in one surface; regions are dropped.
inline Surface together(const Surface& a, const Surface& b) {
  Surface s;
  s.points.resize(a.points.rows() + b.points.rows(), 3);
  s.points << a.points, b.points;
  s.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  s.triangles << a.triangles, b.triangles.array() + static_cast<int>(a.points.rows());
  return s;
}

inline Surface inside_out(Surface s) {
  s.triangles.col(1).swap(s.triangles.col(2));
  return s;
}

/// Every coordinate moved by up to @p by_mm.
inline Surface shaken(Surface s, double by_mm, unsigned seed) {
  std::mt19937 random(seed);
  for (Eigen::Index i = 0; i < s.points.size(); ++i)
    s.points.data()[i] += by_mm * (2.0 * static_cast<double>(random()) / std::mt19937::max() - 1);
  return s;
}

inline Surface moved_by(Surface s, const Eigen::RowVector3d& shift_mm) {
  s.points.rowwise() += shift_mm;
  return s;
}

}  // namespace supine::testing
