// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/surface_check.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "common/error.h"
#include "reconstruction/mesh_edges.h"

namespace supine::reconstruction {
namespace {

int find_root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

void join(std::vector<int>& parent, int a, int b) {
  a = find_root(parent, a);
  b = find_root(parent, b);
  parent[std::max(a, b)] = std::min(a, b);
}

std::vector<int> components_of(const std::vector<MeshEdge>& edges, Eigen::Index triangle_count) {
  std::vector<int> parent(triangle_count);
  std::iota(parent.begin(), parent.end(), 0);
  for (const MeshEdge& edge : edges)
    if (edge.count > 1) join(parent, edge.triangles[0], edge.triangles[1]);
  std::vector<int> number(triangle_count, -1);
  int next = 0;
  for (int t = 0; t < triangle_count; ++t) {
    const int root = find_root(parent, t);
    if (number[root] < 0) number[root] = next++;
    number[t] = number[root];
  }
  return number;
}

// A point is good when its corner triangles hang together through the edges that meet there.
std::vector<int> points_without_one_fan(const Surface& surface, const std::vector<MeshEdge>& edges) {
  std::vector<int> parent(3 * surface.triangles.rows());
  std::iota(parent.begin(), parent.end(), 0);
  const auto corner_of = [&surface](int triangle, int point) {
    int corner = 0;
    while (surface.triangles(triangle, corner) != point) ++corner;
    return 3 * triangle + corner;
  };
  for (const MeshEdge& edge : edges)
    for (const int point : edge.points)
      if (edge.count > 1) join(parent, corner_of(edge.triangles[0], point), corner_of(edge.triangles[1], point));
  std::vector<int> fans(surface.points.rows(), 0), bad;
  for (int i = 0; i < static_cast<int>(parent.size()); ++i)
    if (find_root(parent, i) == i) ++fans[surface.triangles.data()[i]];
  for (int p = 0; p < static_cast<int>(fans.size()); ++p)
    if (fans[p] > 1) bad.push_back(p);
  return bad;
}

double six_volumes(const Surface& surface, Eigen::Index t) {
  const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0)),
                           b = surface.points.row(surface.triangles(t, 1)),
                           c = surface.points.row(surface.triangles(t, 2));
  return a.dot(b.cross(c));
}

double triangle_area(const Surface& surface, Eigen::Index t) {
  const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0));
  const Eigen::RowVector3d u = surface.points.row(surface.triangles(t, 1)) - a,
                           v = surface.points.row(surface.triangles(t, 2)) - a;
  return 0.5 * u.cross(v).norm();
}

}  // namespace

std::vector<int> triangle_components(const Triangles& triangles) {
  return components_of(mesh_edges(triangles), triangles.rows());
}

std::vector<double> component_volumes(const Surface& surface, const std::vector<int>& component) {
  std::vector<double> volume(component.empty() ? 0 : *std::max_element(component.begin(), component.end()) + 1, 0.0);
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) volume[component[t]] += six_volumes(surface, t) / 6;
  return volume;
}

SurfaceReport check_surface(const Surface& surface) {
  SurfaceReport report;
  const std::vector<MeshEdge> edges = mesh_edges(surface.triangles);
  for (const MeshEdge& edge : edges) {
    if (edge.count == 1) ++report.border_edges;
    if (edge.count > 2 || !edge.opposite) {
      ++report.bad_edges;
      if (report.first_bad_point < 0) report.first_bad_point = edge.points[0];
    }
  }
  const std::vector<int> bad_points = points_without_one_fan(surface, edges);
  report.bad_points = static_cast<Eigen::Index>(bad_points.size());
  if (report.first_bad_point < 0 && !bad_points.empty()) report.first_bad_point = bad_points.front();

  std::vector<char> used(surface.points.rows(), 0);
  for (Eigen::Index i = 0; i < surface.triangles.size(); ++i) used[surface.triangles.data()[i]] = 1;
  report.points = std::count(used.begin(), used.end(), 1);
  report.triangles = surface.triangles.rows();
  report.euler = report.points - static_cast<Eigen::Index>(edges.size()) + report.triangles;
  for (Eigen::Index t = 0; t < report.triangles; ++t) {
    const double area = triangle_area(surface, t);
    report.area_mm2 += area;
    // Smooth pieces of a body from CAD go through here as regions of their own, with numbers beyond those of Region.
    const int region = surface.region.size() > 0 ? surface.region(t) : 0;
    if (region >= 0 && region < static_cast<int>(region_names.size())) report.region_area_mm2[region] += area;
  }
  const std::vector<double> volumes = component_volumes(surface, components_of(edges, report.triangles));
  report.components = static_cast<int>(volumes.size());
  report.volume_mm3 = std::accumulate(volumes.begin(), volumes.end(), 0.0);
  if (report.closed())
    report.cavities = static_cast<int>(std::count_if(volumes.begin(), volumes.end(), [](double v) { return v < 0; }));
  return report;
}

void require_solid(const Surface& surface, const std::string& what) {
  const SurfaceReport report = check_surface(surface);
  const auto place = [&surface](Eigen::Index p) {
    return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", surface.points(p, 0), surface.points(p, 1), surface.points(p, 2));
  };
  if (report.triangles == 0) throw InputError(fmt::format("{}: has no triangles; a closed surface is needed", what));
  if (!report.manifold())
    throw InputError(
        fmt::format("{}: not a manifold: {} edges and {} points where more than two sheets meet or the orientation "
                    "changes, the first at {}; repair the surface there",
                    what, report.bad_edges, report.bad_points, place(report.first_bad_point)));
  if (report.border_edges > 0) {
    int point = -1;
    for (const MeshEdge& edge : mesh_edges(surface.triangles))
      if (edge.count == 1 && point < 0) point = edge.points[0];
    throw InputError(
        fmt::format("{}: not closed: {} edges belong to one triangle only, the first at {}; close the hole", what,
                    report.border_edges, place(point)));
  }
  if (report.volume_mm3 <= 0)
    throw InputError(
        fmt::format("{}: encloses {:.1f} mm³: its triangles face inward; turn them round", what, report.volume_mm3));
  const std::vector<std::pair<int, int>> crossings = self_intersections(surface);
  if (!crossings.empty())
    throw InputError(
        fmt::format("{}: intersects itself: {} pairs of triangles, the first at {}; repair the surface there", what,
                    crossings.size(), place(surface.triangles(crossings.front().first, 0))));
}

}  // namespace supine::reconstruction
