// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/decimate.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "common/error.h"
#include "meshing/remesh.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"
#include "reconstruction/surface_tree.h"

namespace supine::meshing {
namespace {

using reconstruction::MeshEdge;
using reconstruction::Surface;
using reconstruction::SurfaceReport;
using reconstruction::SurfaceTree;

constexpr int most_levels = 3;       // edges down to 1/8 of the coarsest
constexpr double start_share = 0.2;  // edges of what is remeshed again and again, of the coarsest
constexpr int most_tries = 16;
constexpr double bound_share = 0.9;  // places nearer to the bound than this are refined

struct Input {
  const Surface& surface;
  SurfaceReport report;
  SurfaceTree tree;
  Surface start;  // what is remeshed: the input, or nearly so where that has many more triangles than needed
};

Points samples_of(const Surface& surface) {
  const std::vector<MeshEdge> edges = reconstruction::mesh_edges(surface.triangles);
  const Eigen::Index points = surface.points.rows(), middles = static_cast<Eigen::Index>(edges.size());
  Points samples(points + middles + surface.triangles.rows(), 3);
  samples.topRows(points) = surface.points;
  for (Eigen::Index e = 0; e < middles; ++e)
    samples.row(points + e) = 0.5 * (surface.points.row(edges[e].points[0]) + surface.points.row(edges[e].points[1]));
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t)
    samples.row(points + middles + t) =
        (surface.points.row(surface.triangles(t, 0)) + surface.points.row(surface.triangles(t, 1)) +
         surface.points.row(surface.triangles(t, 2))) /
        3;
  return samples;
}

std::vector<MeshEdge> region_borders(const Surface& surface) {
  std::vector<MeshEdge> edges = reconstruction::mesh_edges(surface.triangles);
  if (surface.region.size() == 0) return {};
  std::erase_if(edges, [&surface](const MeshEdge& edge) {
    return edge.count == 2 && surface.region(edge.triangles[0]) == surface.region(edge.triangles[1]);
  });
  return edges;
}

// Distance of samples on the output's region borders from those of the input. Searched one by one: they are few.
double border_distance_mm(const Surface& in, const Surface& out, double bound_mm,
                          std::vector<Eigen::Vector3d>& places) {
  const std::vector<MeshEdge> from = region_borders(out), to = region_borders(in);
  if (from.empty() || to.empty()) return 0;
  double largest = 0;
  for (const MeshEdge& edge : from) {
    const Eigen::RowVector3d ends[2] = {out.points.row(edge.points[0]), out.points.row(edge.points[1])};
    for (const Eigen::RowVector3d& at : {ends[0], Eigen::RowVector3d(0.5 * (ends[0] + ends[1]))}) {
      double nearest = 1e300;
      for (const MeshEdge& segment : to) {
        const Eigen::RowVector3d a = in.points.row(segment.points[0]), along = in.points.row(segment.points[1]) - a;
        const double share = std::clamp((at - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
        nearest = std::min(nearest, (a + share * along - at).squaredNorm());
      }
      if (nearest > bound_mm * bound_mm) places.emplace_back(at.transpose());
      largest = std::max(largest, nearest);
    }
  }
  return std::sqrt(largest);
}

void measure_shape(DecimateResult& result) {
  const Surface& s = result.surface;
  const auto edges = reconstruction::mesh_edges(s.triangles);
  double sum = 0;
  for (const MeshEdge& edge : edges) sum += (s.points.row(edge.points[0]) - s.points.row(edge.points[1])).norm();
  result.edge_mm = sum / static_cast<double>(edges.size());
  result.smallest_angle_deg = 180;
  for (Eigen::Index t = 0; t < s.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      const Eigen::RowVector3d at = s.points.row(s.triangles(t, c));
      const Eigen::RowVector3d u = s.points.row(s.triangles(t, (c + 1) % 3)) - at,
                               v = s.points.row(s.triangles(t, (c + 2) % 3)) - at;
      const double angle = std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi;
      result.smallest_angle_deg = std::min(result.smallest_angle_deg, angle);
    }
}

void give_volume_back(const SurfaceReport& wanted, Surface& surface) {
  for (int round = 0; round < 2; ++round) {
    const SurfaceReport now = reconstruction::check_surface(surface);
    const double offset_mm = (wanted.volume_mm3 - now.volume_mm3) / now.area_mm2;
    surface.points += offset_mm * reconstruction::point_normals(surface.points, surface.triangles);
  }
}

// Places of input and output that are near to the bound or beyond it; also fills in the distances.
std::vector<Eigen::Vector3d> places_too_far(const Input& in, double bound_mm, DecimateResult& result) {
  const Points samples = samples_of(result.surface);
  const Eigen::VectorXd to_input = in.tree.distances_mm(samples);
  const Eigen::VectorXd from_input = SurfaceTree(result.surface).distances_mm(in.surface.points);
  result.to_input_mm = to_input.maxCoeff();
  result.from_input_mm = from_input.maxCoeff();
  result.distance_mm = std::max(result.to_input_mm, result.from_input_mm);
  std::vector<Eigen::Vector3d> places;
  result.border_mm = border_distance_mm(in.surface, result.surface, bound_mm, places);
  if (result.distance_mm <= bound_mm) return places;
  for (Eigen::Index p = 0; p < samples.rows(); ++p)
    if (to_input(p) > bound_share * bound_mm) places.emplace_back(samples.row(p).transpose());
  for (Eigen::Index p = 0; p < from_input.size(); ++p)
    if (from_input(p) > bound_share * bound_mm) places.emplace_back(in.surface.points.row(p).transpose());
  return places;
}

std::vector<Eigen::Vector3d> crossing_places(const Surface& surface) {
  std::vector<Eigen::Vector3d> places;
  for (const auto& [a, b] : reconstruction::self_intersections(surface))
    for (const int t : {a, b})
      for (int c = 0; c < 3; ++c) places.emplace_back(surface.points.row(surface.triangles(t, c)).transpose());
  return places;
}

// One place of each cell of a grid of @p cell_mm, so that a region too far away costs a few comparisons only.
std::vector<Eigen::Vector3d> thinned(const std::vector<Eigen::Vector3d>& places, double cell_mm) {
  std::map<std::array<long, 3>, Eigen::Vector3d> cells;
  for (const Eigen::Vector3d& at : places) {
    const Eigen::Vector3d cell = (at / cell_mm).array().floor();
    cells.emplace(std::array<long, 3>{std::lround(cell.x()), std::lround(cell.y()), std::lround(cell.z())}, at);
  }
  std::vector<Eigen::Vector3d> result;
  for (const auto& [cell, at] : cells) result.push_back(at);
  return result;
}

// Every place goes one level below the finest level that claims it already.
void add_places(const std::vector<Eigen::Vector3d>& places, double edge_mm, std::vector<FinePlace>& fine) {
  const std::size_t before = fine.size();
  for (const Eigen::Vector3d& at : thinned(places, edge_mm / 4)) {
    int level = 0;
    for (std::size_t i = 0; i < before; ++i)
      if ((fine[i].point_mm - at).norm() < 2 * edge_mm / std::exp2(fine[i].level))
        level = std::max(level, fine[i].level);
    // The coarser levels surround the finer ones, so that edges grow step by step.
    for (int l = 1; l <= std::min(level + 1, most_levels); ++l) fine.push_back({at, l});
  }
}

bool same_topology(const SurfaceReport& a, const SurfaceReport& b) {
  return b.closed() && b.manifold() && a.components == b.components && a.euler == b.euler;
}

DecimateResult unchanged(const Input& in, const DecimateOptions& options, std::string reason) {
  DecimateResult result;
  result.surface = in.surface;
  result.reached_target = in.report.triangles <= options.target_triangles;
  if (!result.reached_target) result.reason = std::move(reason);
  measure_shape(result);
  return result;
}

// One remeshing at a given coarseness, refined until the bound holds. @return whether it is sound and within the bound
bool refine_to_bound(const Input& in, double edge_mm, const DecimateOptions& options, DecimateResult& result) {
  std::vector<FinePlace> fine;
  for (int round = 0; round <= most_levels + 1; ++round) {
    result.surface = remesh(in.start, edge_mm, fine);
    give_volume_back(in.report, result.surface);
    if (!same_topology(in.report, reconstruction::check_surface(result.surface))) return false;
    std::vector<Eigen::Vector3d> places = places_too_far(in, options.max_distance_mm, result);
    const std::vector<Eigen::Vector3d> crossings = crossing_places(result.surface);
    if (places.empty() && crossings.empty()) return true;
    places.insert(places.end(), crossings.begin(), crossings.end());
    add_places(places, edge_mm, fine);
  }
  return false;
}

}  // namespace

void DecimateOptions::check() const {
  if (target_triangles < 100)
    throw InputError(fmt::format("the number of triangles is {}; it must be at least 100", target_triangles));
  if (!(max_distance_mm > 0))
    throw InputError(fmt::format("the distance bound is {} mm; it must be > 0", max_distance_mm));
}

DecimateResult decimate(const Surface& in, const DecimateOptions& options) {
  options.check();
  reconstruction::require_solid(in, "the surface to decimate");
  Input input{in, reconstruction::check_surface(in), SurfaceTree(in), in};
  if (input.report.triangles <= options.target_triangles) return unchanged(input, options, "");

  // Equilateral triangles of that edge would give the target; those of the remeshing come out a tenth smaller.
  double edge_mm = 1.12 * std::sqrt(4 * input.report.area_mm2 / (std::numbers::sqrt3 * options.target_triangles));
  const auto start_triangles = static_cast<Eigen::Index>(options.target_triangles / (start_share * start_share));
  if (input.report.triangles > 2 * start_triangles) input.start = remesh(in, start_share * edge_mm, {}, 1);
  DecimateResult best;
  for (int attempt = 0; attempt < most_tries; ++attempt) {
    DecimateResult result;
    if (!refine_to_bound(input, edge_mm, options, result)) {
      edge_mm *= 0.8;
      if (best.surface.triangles.rows() > 0) break;
      continue;
    }
    const auto triangles = result.surface.triangles.rows();
    const auto best_triangles = best.surface.triangles.rows();
    const bool fits = triangles <= options.target_triangles, best_fits = best.reached_target;
    if (best_triangles == 0 || (fits && (!best_fits || triangles > best_triangles)) ||
        (!fits && !best_fits && triangles < best_triangles)) {
      best = std::move(result);
      best.reached_target = fits;
    }
    if (fits && triangles >= 0.9 * options.target_triangles) break;
    if (attempt >= 5) break;
    edge_mm *= std::sqrt(static_cast<double>(triangles) / (0.95 * options.target_triangles));
  }
  if (best.surface.triangles.rows() == 0)
    return unchanged(input, options,
                     "no coarser surface stays within the bound without crossing itself; the input is returned");
  if (!best.reached_target)
    best.reason = fmt::format(
        "{} triangles are needed to stay within {} mm of the input; allow more triangles or a larger distance",
        best.surface.triangles.rows(), options.max_distance_mm);
  best.volume_change = reconstruction::check_surface(best.surface).volume_mm3 / input.report.volume_mm3 - 1;
  measure_shape(best);
  return best;
}

}  // namespace supine::meshing
