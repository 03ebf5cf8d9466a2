// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/grade.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/error.h"
#include "meshing/surface/remesh.h"
#include "meshing/tetrahedra/tetrahedralise.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"

namespace supine::meshing {
namespace {

using reconstruction::Region;
using reconstruction::Surface;

constexpr int most_levels = 3;

bool between_skin_and_cut(const Surface& surface, const reconstruction::MeshEdge& edge) {
  if (edge.count != 2) return false;
  const auto [a, b] = std::minmax(surface.region[edge.triangles[0]], surface.region[edge.triangles[1]]);
  return a == static_cast<int>(Region::skin) && b == static_cast<int>(Region::cut);
}

// Places along the border, closer together than the shortest edges reach.
std::vector<Eigen::Vector3d> border_places(const Surface& surface, double spacing_mm) {
  std::vector<Eigen::Vector3d> places;
  for (const reconstruction::MeshEdge& edge : reconstruction::mesh_edges(surface.triangles)) {
    if (!between_skin_and_cut(surface, edge)) continue;
    const Eigen::Vector3d a = surface.points.row(edge.points[0]), b = surface.points.row(edge.points[1]);
    const int pieces = std::max(1, static_cast<int>(std::ceil((b - a).norm() / spacing_mm)));
    for (int i = 0; i < pieces; ++i) places.push_back(a + (i + 0.5) / pieces * (b - a));
  }
  return places;
}

// The fine places remeshed, with the volume of before.
Surface refined(const Surface& surface, double mean_mm, const std::vector<FinePlace>& fine) {
  if (fine.empty()) return surface;
  Surface graded = refine(surface, mean_mm, fine);
  const reconstruction::SurfaceReport wanted = reconstruction::check_surface(surface);
  const reconstruction::SurfaceReport now = reconstruction::check_surface(graded);
  graded.points += (wanted.volume_mm3 - now.volume_mm3) / now.area_mm2 *
                   reconstruction::point_normals(graded.points, graded.triangles);
  return graded;
}

}  // namespace

Surface refine_skin_edge(const Surface& surface, double edge_mm) {
  if (!(edge_mm > 0))
    throw InputError(fmt::format("the edge length at the skin's border is {} mm; it must be > 0", edge_mm));
  const double mean_mm = mean_edge_mm(surface);
  const int levels = std::clamp(static_cast<int>(std::lround(std::log2(mean_mm / edge_mm))), 0, most_levels);
  if (levels == 0) return surface;
  std::vector<FinePlace> fine;
  for (const Eigen::Vector3d& place : border_places(surface, mean_mm / std::exp2(levels)))
    for (int level = 1; level <= levels; ++level) fine.push_back({place, level});
  return refined(surface, mean_mm, fine);
}

double skin_edge_mm(const Surface& surface) {
  double length = 0;
  int count = 0;
  for (const reconstruction::MeshEdge& edge : reconstruction::mesh_edges(surface.triangles)) {
    if (!between_skin_and_cut(surface, edge)) continue;
    length += (surface.points.row(edge.points[0]) - surface.points.row(edge.points[1])).norm();
    ++count;
  }
  return count > 0 ? length / count : 0;
}

Surface refine_to_sizes(const Surface& surface, const SizeField& sizes) {
  const double mean_mm = mean_edge_mm(surface);
  std::vector<FinePlace> fine;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (int c = 0; c < 3; ++c) centre += surface.points.row(surface.triangles(t, c)).transpose() / 3;
    const int levels = std::clamp(static_cast<int>(std::lround(std::log2(mean_mm / sizes.at(centre)))), 0, most_levels);
    for (int level = 1; level <= levels; ++level) fine.push_back({centre, level});
  }
  return refined(surface, mean_mm, fine);
}

}  // namespace supine::meshing
