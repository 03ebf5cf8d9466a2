// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/cell_raster.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "meshing/topology.h"
#include "simulation/elements/curved_cell.h"

namespace supine::warp {
namespace {

// Of barycentric coordinates: a voxel on a common face belongs to one of the two cells, not to none.
constexpr double inside_tolerance = 1e-9;
// A voxel this deep in two cells is no voxel on their common face.
constexpr float deep = 0.02F;

/// Box of a cell in continuous indices. A curved cell lies in the hull of its Bézier points.
Eigen::Matrix<double, 2, 3> box_of(const Points& index, const Indices& cells, Eigen::Index c) {
  Eigen::Matrix<double, 2, 3> box;
  box.row(0) = box.row(1) = index.row(cells(c, 0));
  const auto take = [&box](const Eigen::RowVector3d& p) {
    box.row(0) = box.row(0).cwiseMin(p);
    box.row(1) = box.row(1).cwiseMax(p);
  };
  for (int a = 1; a < 4; ++a) take(index.row(cells(c, a)));
  for (Eigen::Index e = 0; e + 4 < cells.cols(); ++e) {
    const auto& [a, b] = meshing::tet_edges[static_cast<std::size_t>(e)];
    take(2 * index.row(cells(c, 4 + e)) - 0.5 * (index.row(cells(c, a)) + index.row(cells(c, b))));
  }
  return box;
}

/// Barycentric coordinates of the straight cell as a linear map of (i, j, k, 1).
Eigen::Matrix4d barycentric_map(const Points& index, const Indices& cells, int c) {
  Eigen::Matrix4d corners;
  for (int a = 0; a < 4; ++a) corners.col(a) << index.row(cells(c, a)).transpose(), 1;
  return corners.inverse();
}

/// How far below 0 the barycentric coordinates in the straight cell may fall at points of the curved one. With δ_e what
/// edge e is bent by and B the straight map, they differ by Σ 4 b_i b_j B δ_e, and Σ b_i b_j ≤ 3/8.
double bend(const Points& index, const Indices& cells, int c, const Eigen::Matrix4d& map) {
  double most = 0;
  for (int e = 0; e < 6; ++e) {
    const auto& [a, b] = meshing::tet_edges[static_cast<std::size_t>(e)];
    const Eigen::RowVector3d bent =
        index.row(cells(c, 4 + e)) - 0.5 * (index.row(cells(c, a)) + index.row(cells(c, b)));
    most = std::max(most, (map.leftCols<3>() * bent.transpose()).cwiseAbs().maxCoeff());
  }
  return 1.5 * most + inside_tolerance;
}

/// Voxels of a slice that a cell's box may hold.
struct Window {
  int i0, i1, j0, j1;

  /// @param box   least and largest index, 2 by 3
  /// @param size  voxels of the grid
  template <class Box, class Size>
  Window(const Box& box, const Size& size)
      : i0(std::max(0, static_cast<int>(std::ceil(box(0, 0) - inside_tolerance)))),
        i1(std::min(static_cast<int>(size.x()) - 1, static_cast<int>(std::floor(box(1, 0) + inside_tolerance)))),
        j0(std::max(0, static_cast<int>(std::ceil(box(0, 1) - inside_tolerance)))),
        j1(std::min(static_cast<int>(size.y()) - 1, static_cast<int>(std::floor(box(1, 1) + inside_tolerance)))) {}
};

}  // namespace

void Slab::start(const segmentation::Grid& grid, int from, int slices) {
  first = from, count = slices;
  const std::size_t voxels = static_cast<std::size_t>(grid.size.x()) * grid.size.y() * static_cast<std::size_t>(slices);
  mm.assign(voxels, Eigen::Vector3f::Zero());
  place.assign(voxels, Place::elsewhere);
}

void Overlap::add(const Overlap& other) {
  if (voxels == 0) place_mm = other.place_mm;
  voxels += other.voxels;
}

CellRaster::CellRaster(const meshing::TetMesh& mesh, const Points& target, const Points& source,
                       const segmentation::Grid& grid)
    : mesh_(mesh),
      target_(target),
      grid_(grid),
      index_(target.rows(), 3),
      way_(source - target),
      by_slice_(static_cast<std::size_t>(grid.size.z())) {
  for (Eigen::Index p = 0; p < target.rows(); ++p)
    index_.row(p) = grid.continuous_index(target.row(p).transpose()).transpose();
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    const auto box = box_of(index_, mesh.cells, c);
    const double last = grid.size.z() - 1;
    if (box(1, 2) < 0 || box(0, 2) > last) continue;
    const int from = static_cast<int>(std::ceil(std::max(0.0, box(0, 2) - inside_tolerance)));
    const int to = static_cast<int>(std::floor(std::min(last, box(1, 2) + inside_tolerance)));
    for (int k = from; k <= to; ++k) by_slice_[static_cast<std::size_t>(k)].push_back(static_cast<int>(c));
  }
}

/// Calls found(voxel of the slice, smallest barycentric coordinate, way).
template <class Found>
void CellRaster::visit_linear(int cell, int k, Found found) const {
  const Eigen::Matrix4d map = barycentric_map(index_, mesh_.cells, cell);
  if (!map.allFinite()) return;
  Eigen::Matrix<double, 3, 4> way;
  for (int a = 0; a < 4; ++a) way.col(a) = way_.row(mesh_.cells(cell, a)).transpose();
  const Window window(box_of(index_, mesh_.cells, cell), grid_.size);
  for (int j = window.j0; j <= window.j1; ++j)
    for (int i = window.i0; i <= window.i1; ++i) {
      const Eigen::Vector4d b = map * Eigen::Vector4d(i, j, k, 1);
      const double least = b.minCoeff();
      if (least >= -inside_tolerance)
        found(static_cast<std::size_t>(j) * grid_.size.x() + i, least, Eigen::Vector3d(way * b));
    }
}

template <class Found>
void CellRaster::visit_quadratic(int cell, int k, Found found) const {
  const Eigen::Matrix4d map = barycentric_map(index_, mesh_.cells, cell);
  if (!map.allFinite()) return;
  const double below = bend(index_, mesh_.cells, cell, map);
  const simulation::CurvedCell curved(target_, mesh_.cells, cell);
  const auto way = simulation::gather<10>(way_, mesh_.cells, cell);
  const Window window(box_of(index_, mesh_.cells, cell), grid_.size);
  for (int j = window.j0; j <= window.j1; ++j)
    for (int i = window.i0; i <= window.i1; ++i) {
      const Eigen::Vector4d straight = map * Eigen::Vector4d(i, j, k, 1);
      if (straight.minCoeff() < -below) continue;
      const auto b = curved.inside(grid_.point(Eigen::Vector3d(i, j, k)), straight);
      if (b)
        found(static_cast<std::size_t>(j) * grid_.size.x() + i, b->minCoeff(),
              Eigen::Vector3d(way.transpose() * simulation::tet10_shape(*b)));
    }
}

void CellRaster::fill_slice(int k, Slab& slab, std::vector<float>& depth, Overlap& overlap) const {
  const std::size_t in_slice = static_cast<std::size_t>(grid_.size.x()) * grid_.size.y();
  const std::size_t offset = static_cast<std::size_t>(k - slab.first) * in_slice;
  depth.assign(in_slice, 0);
  const auto found = [&](std::size_t voxel, double least, const Eigen::Vector3d& way) {
    const std::size_t at = offset + voxel;
    if (slab.place[at] == Place::body) {
      if (depth[voxel] < deep || least < deep) return;
      const int i = static_cast<int>(voxel % grid_.size.x()), j = static_cast<int>(voxel / grid_.size.x());
      overlap.add({1, grid_.point(Eigen::Vector3d(i, j, k))});
      return;
    }
    slab.place[at] = Place::body;
    slab.mm[at] = way.cast<float>();
    depth[voxel] = static_cast<float>(least);
  };
  for (const int cell : by_slice_[static_cast<std::size_t>(k)]) {
    if (mesh_.order() == 2)
      visit_quadratic(cell, k, found);
    else
      visit_linear(cell, k, found);
  }
}

Overlap CellRaster::fill(Slab& slab) const {
  std::vector<Overlap> overlaps(static_cast<std::size_t>(slab.count));
#pragma omp parallel
  {
    std::vector<float> depth;
#pragma omp for schedule(dynamic)
    for (int s = 0; s < slab.count; ++s) fill_slice(slab.first + s, slab, depth, overlaps[static_cast<std::size_t>(s)]);
  }
  Overlap all;
  for (const Overlap& overlap : overlaps)
    if (overlap.voxels > 0) all.add(overlap);
  return all;
}

std::vector<std::uint8_t> CellRaster::mask() const {
  const std::size_t in_slice = static_cast<std::size_t>(grid_.size.x()) * grid_.size.y();
  std::vector<std::uint8_t> inside(grid_.count(), 0);
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < grid_.size.z(); ++k) {
    const auto found = [&](std::size_t voxel, double, const Eigen::Vector3d&) {
      inside[static_cast<std::size_t>(k) * in_slice + voxel] = 1;
    };
    for (const int cell : by_slice_[static_cast<std::size_t>(k)]) {
      if (mesh_.order() == 2)
        visit_quadratic(cell, k, found);
      else
        visit_linear(cell, k, found);
    }
  }
  return inside;
}

}  // namespace supine::warp
