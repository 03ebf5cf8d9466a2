// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/surface/sound_surface.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/error.h"
#include "meshing/surface/crossings.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;

// Twice the area over the longest edge squared: below this, rounding decides which way a triangle faces.
constexpr double flat = 1e-12;

Eigen::Vector3d corner(const Surface& s, Eigen::Index t, int c) { return s.points.row(s.triangles(t, c)).transpose(); }

std::string place(const Eigen::Vector3d& p) { return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z()); }

void require_numbers(const Surface& surface, const std::string& what) {
  if (surface.triangles.rows() == 0) throw InputError(fmt::format("{}: has no triangles; a surface is needed", what));
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) {
      const int p = surface.triangles(t, c);
      if (p < 0 || p >= surface.points.rows())
        throw InputError(fmt::format("{}: triangle {} names point {}; the surface has points 0 to {}", what, t, p,
                                     surface.points.rows() - 1));
      if (!surface.points.row(p).allFinite())
        throw InputError(fmt::format("{}: point {} of triangle {} lies at {}, which is no place; mend the file", what,
                                     p, t, place(corner(surface, t, c))));
    }
}

void require_areas(const Surface& surface, const std::string& what) {
  int count = 0;
  Eigen::Index first = 0;
  for (Eigen::Index t = surface.triangles.rows(); t-- > 0;) {
    const Eigen::Vector3d u = corner(surface, t, 1) - corner(surface, t, 0),
                          v = corner(surface, t, 2) - corner(surface, t, 0);
    const double longest = std::max({u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm()});
    if (u.cross(v).norm() > flat * longest) continue;
    ++count;
    first = t;
  }
  if (count > 0)
    throw InputError(fmt::format("{}: {} triangles without area, the first at {}; merge their points", what, count,
                                 place(corner(surface, first, 0))));
}

reconstruction::SurfaceReport require_manifold(const Surface& surface, Borders borders, const std::string& what) {
  const reconstruction::SurfaceReport report = reconstruction::check_surface(surface);
  if (!report.manifold())
    throw InputError(fmt::format(
        "{}: not a manifold: {} edges and {} points where more than two sheets meet or the orientation "
        "changes, the first at {}; repair the surface there",
        what, report.bad_edges, report.bad_points, place(surface.points.row(report.first_bad_point).transpose())));
  if (report.border_edges == 0 || borders == Borders::allowed) return report;
  for (const reconstruction::MeshEdge& edge : reconstruction::mesh_edges(surface.triangles))
    if (edge.count == 1)
      throw InputError(
          fmt::format("{}: not closed: {} edges belong to one triangle only, the first at {}; close the hole", what,
                      report.border_edges, place(surface.points.row(edge.points[0]).transpose())));
  return report;
}

void require_no_crossings(const Surface& surface, const TriangleTree& tree, const std::string& what) {
  const auto pairs = crossings(surface, tree);
  if (!pairs.empty())
    throw InputError(
        fmt::format("{}: intersects itself: {} pairs of triangles, the first at {}; repair the surface there", what,
                    pairs.size(), place(corner(surface, pairs.front().first, 0))));
}

struct Piece {
  Triangles triangles;
  Eigen::AlignedBox3d box;
  double volume_mm3 = 0;
  bool open = false;
};

std::vector<Piece> pieces_of(const Surface& surface) {
  const std::vector<int> component = reconstruction::triangle_components(surface.triangles);
  const std::vector<double> volumes = reconstruction::component_volumes(surface, component);
  std::vector<Piece> pieces(volumes.size());
  std::vector<Eigen::Index> size(pieces.size(), 0);
  for (const int c : component) ++size[c];
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    pieces[i].triangles.resize(size[i], 3);
    pieces[i].volume_mm3 = volumes[i];
  }
  for (Eigen::Index t = surface.triangles.rows(); t-- > 0;) {
    Piece& piece = pieces[component[t]];
    piece.triangles.row(--size[component[t]]) = surface.triangles.row(t);
    for (int c = 0; c < 3; ++c) piece.box.extend(corner(surface, t, c));
  }
  for (const reconstruction::MeshEdge& edge : reconstruction::mesh_edges(surface.triangles))
    if (edge.count == 1) pieces[component[edge.triangles[0]]].open = true;
  return pieces;
}

// Pieces that enclose space must take turns: outward, a cavity inside that, a body in the cavity.
void require_orientation(const Surface& surface, const reconstruction::SurfaceReport& report, const std::string& what) {
  if (report.components == 1 && (!report.closed() || report.volume_mm3 > 0)) return;
  const std::vector<Piece> pieces = pieces_of(surface);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (pieces[i].open) continue;
    const Eigen::Vector3d at = surface.points.row(pieces[i].triangles(0, 0)).transpose();
    int around = 0;
    for (std::size_t j = 0; j < pieces.size(); ++j)
      if (j != i && !pieces[j].open && pieces[j].box.contains(at) &&
          std::abs(winding_number(surface.points, pieces[j].triangles, at)) > 0.5)
        ++around;
    if ((pieces[i].volume_mm3 > 0) == (around % 2 == 0)) continue;
    if (around % 2 == 0)
      throw InputError(
          fmt::format("{}: the closed piece at {} encloses {:.1f} mm³: its triangles face inward; turn them round",
                      what, place(at), pieces[i].volume_mm3));
    throw InputError(
        fmt::format("{}: the closed piece at {} lies inside another and faces outward as that does; turn it round to "
                    "make it a cavity, or take it out",
                    what, place(at)));
  }
}

}  // namespace

SoundSurface require_sound(const Surface& surface, Borders borders, const std::string& what) {
  require_numbers(surface, what);
  require_areas(surface, what);
  SoundSurface sound;
  sound.report = require_manifold(surface, borders, what);
  sound.tree = std::make_shared<const TriangleTree>(surface.points, surface.triangles);
  require_no_crossings(surface, *sound.tree, what);
  require_orientation(surface, sound.report, what);
  return sound;
}

double winding_number(const Points& points, const Triangles& triangles, const Eigen::Vector3d& at) {
  double sum = 0;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Eigen::Vector3d a = points.row(triangles(t, 0)).transpose() - at,
                          b = points.row(triangles(t, 1)).transpose() - at,
                          c = points.row(triangles(t, 2)).transpose() - at;
    const double x = a.norm(), y = b.norm(), z = c.norm();
    sum += std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }
  return sum / (2 * std::numbers::pi);
}

}  // namespace supine::meshing
