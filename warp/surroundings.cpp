// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/surroundings.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/surface.h"

namespace supine::warp {
namespace {

// Of a face with nodes 0 1 2 and the middles 3 (01), 4 (12), 5 (20).
constexpr int quarters[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};

Triangles boundary_triangles(const meshing::TetMesh& mesh) {
  if (mesh.faces.cols() == 3) return mesh.faces;
  Triangles triangles(4 * mesh.faces.rows(), 3);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (int q = 0; q < 4; ++q)
      for (int a = 0; a < 3; ++a) triangles(4 * f + q, a) = mesh.faces(f, quarters[q][a]);
  return triangles;
}

std::vector<bool> skin_of(const meshing::TetMesh& mesh) {
  std::vector<bool> skin;
  const int pieces = mesh.faces.cols() == 3 ? 1 : 4;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    skin.insert(skin.end(), static_cast<std::size_t>(pieces),
                mesh.region[f] == static_cast<int>(reconstruction::Region::skin));
  return skin;
}

/// Reach over the skin at each node.
Eigen::VectorXd air_reach(const meshing::TetMesh& mesh, const Points& target, const Reach& reach) {
  Eigen::VectorXd air = Eigen::VectorXd::Constant(target.rows(), reach.air_mm);
  if (reach.air_mm <= reach.tissue_mm) return air;
  std::vector<bool> other(static_cast<std::size_t>(target.rows()), false), skin = other;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (Eigen::Index a = 0; a < mesh.faces.cols(); ++a)
      (mesh.region[f] == static_cast<int>(reconstruction::Region::skin)
           ? skin
           : other)[static_cast<std::size_t>(mesh.faces(f, a))] = true;
  std::vector<Eigen::Index> ends;
  for (Eigen::Index p = 0; p < target.rows(); ++p)
    if (skin[static_cast<std::size_t>(p)] && other[static_cast<std::size_t>(p)]) ends.push_back(p);
#pragma omp parallel for
  for (Eigen::Index p = 0; p < target.rows(); ++p) {
    if (!skin[static_cast<std::size_t>(p)]) continue;
    for (const Eigen::Index end : ends)
      air[p] = std::min(air[p], reach.tissue_mm + 2 * (target.row(p) - target.row(end)).norm());
  }
  return air;
}

// Closer to the skin than this a voxel shows what partial volume and blur make of it.
constexpr double edge_mm = 3;

double falling(double distance, double reach) {
  const double t = reach > 0 ? distance / reach : 1;
  return t >= 1 ? 0 : 1 - t * t * (3 - 2 * t);
}

}  // namespace

Surroundings::Surroundings(const meshing::TetMesh& mesh, const Points& target, const Points& source, const Reach& reach)
    : surface_(target, boundary_triangles(mesh)),
      is_skin_(skin_of(mesh)),
      way_(source - target),
      air_mm_(air_reach(mesh, target, reach)),
      reach_(reach) {}

/// Voxels of the slab in blocks that the surface may reach, but for the body's.
std::vector<std::size_t> Surroundings::near_voxels(const segmentation::Grid& grid, const Slab& slab) const {
  constexpr int block = 8;
  const int columns = grid.size.x() / block + 1, rows = grid.size.y() / block + 1;
  std::vector<bool> near(static_cast<std::size_t>(columns) * rows, false);
  const Eigen::Vector3d margin = std::max(reach_.tissue_mm, reach_.air_mm) * grid.spacing_mm.cwiseInverse();
  const Points& points = surface_.points();
  for (Eigen::Index t = 0; t < surface_.triangles().rows(); ++t) {
    Eigen::Vector3d low = grid.continuous_index(points.row(surface_.triangles()(t, 0)).transpose()), high = low;
    for (int a = 1; a < 3; ++a) {
      const Eigen::Vector3d p = grid.continuous_index(points.row(surface_.triangles()(t, a)).transpose());
      low = low.cwiseMin(p), high = high.cwiseMax(p);
    }
    low -= margin, high += margin;
    if (high.z() < slab.first || low.z() > slab.first + slab.count - 1) continue;
    const auto of = [](double index, int count) {
      return std::clamp(static_cast<int>(std::floor(index / block)), 0, count - 1);
    };
    if (high.x() < 0 || high.y() < 0 || low.x() > grid.size.x() || low.y() > grid.size.y()) continue;
    for (int r = of(low.y(), rows); r <= of(high.y(), rows); ++r)
      for (int c = of(low.x(), columns); c <= of(high.x(), columns); ++c)
        near[static_cast<std::size_t>(r) * columns + c] = true;
  }
  std::vector<std::size_t> voxels;
  std::size_t at = 0;
  for (int k = 0; k < slab.count; ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i, ++at)
        if (slab.place[at] != Place::body && near[static_cast<std::size_t>(j / block) * columns + i / block])
          voxels.push_back(at);
  return voxels;
}

void Surroundings::fill(const segmentation::Grid& grid, Slab& slab) const {
  if (std::max(reach_.tissue_mm, reach_.air_mm) <= 0) return;
  const std::vector<std::size_t> voxels = near_voxels(grid, slab);
  if (voxels.empty()) return;
  const std::size_t row = static_cast<std::size_t>(grid.size.x()), slice = row * grid.size.y();
  Points queries(static_cast<Eigen::Index>(voxels.size()), 3);
#pragma omp parallel for
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    const std::size_t at = voxels[v];
    queries.row(static_cast<Eigen::Index>(v)) =
        grid.point({static_cast<double>(at % row), static_cast<double>(at % slice / row),
                    static_cast<double>(at / slice) + slab.first})
            .transpose();
  }
  calibration::ClosestPoints closest;
  surface_.closest(queries, closest);
#pragma omp parallel for
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    const auto q = static_cast<Eigen::Index>(v);
    const double distance = closest.distance_mm[q];
    const bool air = is_skin_[static_cast<std::size_t>(closest.triangle[q])];
    Eigen::RowVector3d way = Eigen::RowVector3d::Zero();
    double over_skin = 0;
    for (int a = 0; a < 3; ++a) {
      way += closest.weight(q, a) * way_.row(closest.node(q, a));
      over_skin += closest.weight(q, a) * air_mm_[closest.node(q, a)];
    }
    const double fading = air ? std::max(0.0, 1 - distance / over_skin) : falling(distance, reach_.tissue_mm);
    if (fading <= 0) continue;
    const bool whole = air && !reach_.air_fades;
    slab.mm[voxels[v]] = ((whole ? 1 : fading) * way.transpose()).cast<float>();
    slab.place[voxels[v]] = (whole ? distance < edge_mm : fading > 0.5) ? Place::edge : Place::beside;
  }
}

}  // namespace supine::warp
