// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/decimate/measure.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "meshing/quads/quad_pairs.h"
#include "reconstruction/mesh_edges.h"

namespace supine::meshing {
namespace {

using reconstruction::MeshEdge;
using reconstruction::Surface;
using reconstruction::SurfaceReport;

constexpr double bound_share = 0.9;     // places nearer to the bound than this are refined
constexpr double samples_per_edge = 8;  // of the output's mean edge
constexpr int most_steps = 64;          // of the lattice in one triangle

Eigen::Vector3d area_vector(const Surface& surface, Eigen::Index t) {
  const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0));
  const Eigen::RowVector3d u = surface.points.row(surface.triangles(t, 1)) - a,
                           v = surface.points.row(surface.triangles(t, 2)) - a;
  return 0.5 * u.cross(v).transpose();
}

std::vector<MeshEdge> borders(const Surface& surface) {
  std::vector<MeshEdge> edges = reconstruction::mesh_edges(surface.triangles);
  std::erase_if(edges, [&surface](const MeshEdge& edge) {
    return edge.count == 2 &&
           (surface.region.size() == 0 || surface.region(edge.triangles[0]) == surface.region(edge.triangles[1]));
  });
  return edges;
}

// Edges as triangles with two corners at once, which closest points do not mind.
Triangles as_triangles(const std::vector<MeshEdge>& edges) {
  Triangles result(static_cast<Eigen::Index>(edges.size()), 3);
  for (std::size_t e = 0; e < edges.size(); ++e)
    result.row(static_cast<Eigen::Index>(e)) << edges[e].points[0], edges[e].points[1], edges[e].points[1];
  return result;
}

double mean_edge(const Surface& surface, const Eigen::VectorXi& quad) {
  double sum = 0, count = 0;
  for (const MeshEdge& edge : reconstruction::mesh_edges(surface.triangles)) {
    const bool diagonal = quad.size() > 0 && edge.count == 2 && quad(edge.triangles[0]) >= 0 &&
                          quad(edge.triangles[0]) == quad(edge.triangles[1]);
    if (diagonal) continue;
    sum += (surface.points.row(edge.points[0]) - surface.points.row(edge.points[1])).norm();
    count += 1;
  }
  return sum / count;
}

void add_beyond(const Points& samples, const Eigen::VectorXd& distances, double limit_mm,
                std::vector<Eigen::Vector3d>& places) {
  for (Eigen::Index p = 0; p < samples.rows(); ++p)
    if (distances(p) > limit_mm) places.emplace_back(samples.row(p).transpose());
}

}  // namespace

Points dense_samples(const Surface& surface, double spacing_mm) {
  std::vector<Eigen::RowVector3d> inside;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0)),
                             b = surface.points.row(surface.triangles(t, 1)),
                             c = surface.points.row(surface.triangles(t, 2));
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int steps = std::clamp(static_cast<int>(std::ceil(longest / spacing_mm)), 1, most_steps);
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j) {
        const int k = steps - i - j;
        if (i == steps || j == steps || k == steps) continue;  // the corners are points already
        inside.emplace_back((a * k + b * i + c * j) / steps);
      }
  }
  Points samples(surface.points.rows() + static_cast<Eigen::Index>(inside.size()), 3);
  samples.topRows(surface.points.rows()) = surface.points;
  for (std::size_t i = 0; i < inside.size(); ++i)
    samples.row(surface.points.rows() + static_cast<Eigen::Index>(i)) = inside[i];
  return samples;
}

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

DecimateMeasure::DecimateMeasure(const Surface& in)
    : DecimateMeasure(
          in, {reconstruction::check_surface(in), std::make_shared<const TriangleTree>(in.points, in.triangles)}) {}

DecimateMeasure::DecimateMeasure(const Surface& in, SoundSurface sound)
    : in_(in), report_(std::move(sound.report)), tree_(std::move(sound.tree)) {
  // An input of large triangles is sampled between its points too.
  const double spacing_mm = std::sqrt(report_.area_mm2 / 200000);
  const double edge_mm =
      std::sqrt(4 * report_.area_mm2 / (std::numbers::sqrt3 * static_cast<double>(report_.triangles)));
  samples_ = edge_mm > 2 * spacing_mm ? dense_samples(in, 2 * spacing_mm) : in.points;
  if (in.region.size() == 0 && report_.closed()) return;
  const std::vector<MeshEdge> edges = borders(in);
  if (!edges.empty()) border_ = std::make_unique<TriangleTree>(in.points, as_triangles(edges));
}

bool DecimateMeasure::same_topology(const Surface& out) const {
  const SurfaceReport now = reconstruction::check_surface(out);
  return now.manifold() && now.closed() == report_.closed() && now.components == report_.components &&
         now.euler == report_.euler;
}

std::vector<Eigen::Vector3d> DecimateMeasure::places_too_far(double bound_mm, DecimateResult& result) const {
  const Points samples = dense_samples(result.surface, mean_edge(result.surface, result.quad) / samples_per_edge);
  const Eigen::VectorXd to_input = tree_->distances_mm(samples);
  const Eigen::VectorXd from_input =
      TriangleTree(result.surface.points, result.surface.triangles).distances_mm(samples_);
  result.to_input_mm = to_input.maxCoeff();
  result.from_input_mm = from_input.maxCoeff();
  result.mean_to_input_mm = to_input.mean();
  result.mean_from_input_mm = from_input.mean();
  result.distance_mm = std::max(result.to_input_mm, result.from_input_mm);
  std::vector<Eigen::Vector3d> places;
  result.border_mm = 0;
  if (border_) {
    std::vector<Eigen::RowVector3d> at;
    for (const MeshEdge& edge : borders(result.surface))
      for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0})
        at.emplace_back((1 - share) * result.surface.points.row(edge.points[0]) +
                        share * result.surface.points.row(edge.points[1]));
    Points on_border(static_cast<Eigen::Index>(at.size()), 3);
    for (std::size_t i = 0; i < at.size(); ++i) on_border.row(static_cast<Eigen::Index>(i)) = at[i];
    const Eigen::VectorXd away = border_->distances_mm(on_border);
    if (away.size() > 0) result.border_mm = away.maxCoeff();
    if (result.border_mm > bound_mm) add_beyond(on_border, away, bound_share * bound_mm, places);
  }
  if (result.distance_mm <= bound_mm) return places;
  add_beyond(samples, to_input, bound_share * bound_mm, places);
  add_beyond(samples_, from_input, bound_share * bound_mm, places);
  return places;
}

std::vector<Eigen::Vector3d> DecimateMeasure::unsound_places(const Surface& out) const {
  std::vector<Eigen::Vector3d> places;
  for (const auto& [a, b] : reconstruction::self_intersections(out))
    for (const int t : {a, b})
      for (int c = 0; c < 3; ++c) places.emplace_back(out.points.row(out.triangles(t, c)).transpose());
  for (Eigen::Index t = 0; t < out.triangles.rows(); ++t) {
    const Eigen::Vector3d centre = (out.points.row(out.triangles(t, 0)) + out.points.row(out.triangles(t, 1)) +
                                    out.points.row(out.triangles(t, 2)))
                                       .transpose() /
                                   3;
    const TriangleTree::Hit hit = tree_->closest(centre);
    // Opposite to the input beneath: turned over. A little more than a right angle happens at sharp rims.
    const Eigen::Vector3d own = area_vector(out, t).normalized(), beneath = area_vector(in_, hit.triangle).normalized();
    if (own.dot(beneath) < -0.5) places.push_back(centre);
  }
  return places;
}

void DecimateMeasure::give_volume_back(Surface& out) const {
  if (!report_.closed()) return;
  for (int round = 0; round < 2; ++round) {
    const SurfaceReport now = reconstruction::check_surface(out);
    const double offset_mm = (report_.volume_mm3 - now.volume_mm3) / now.area_mm2;
    out.points += offset_mm * reconstruction::point_normals(out.points, out.triangles);
  }
}

void DecimateMeasure::measure_shape(DecimateResult& result) const {
  const Surface& s = result.surface;
  if (result.quad.size() == 0) {
    result.quad = Eigen::VectorXi::Constant(s.triangles.rows(), -1);
    result.quads = 0;
    result.alone = static_cast<int>(s.triangles.rows());
  }
  result.edge_mm = mean_edge(s, result.quad);
  result.smallest_angle_deg = 180;
  for (Eigen::Index t = 0; t < s.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      const Eigen::RowVector3d at = s.points.row(s.triangles(t, c));
      const Eigen::RowVector3d u = s.points.row(s.triangles(t, (c + 1) % 3)) - at,
                               v = s.points.row(s.triangles(t, (c + 2) % 3)) - at;
      const double angle = std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi;
      result.smallest_angle_deg = std::min(result.smallest_angle_deg, angle);
    }
  const Eigen::VectorXd deviations = quad_deviations_deg(s, {result.quad, result.quads, result.alone});
  if (deviations.size() > 0) result.mean_deviation_deg = deviations.mean();
  if (report_.closed()) result.volume_change = reconstruction::check_surface(s).volume_mm3 / report_.volume_mm3 - 1;
}

}  // namespace supine::meshing
