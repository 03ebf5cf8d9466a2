// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/shaping.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_map>

#include "common/error.h"
#include "reconstruction/fairing.h"
#include "reconstruction/mesh_edges.h"
#include "reconstruction/surface_check.h"

namespace supine::reconstruction {
namespace {

constexpr double largest_offset_voxels = 0.5;  // fairing cannot shrink by more
constexpr double negligible_volume = 1e-4;

/// Number of the grid edge that a point lies on, the same for the surface on either side.
std::uint64_t grid_edge(const VoxelSurface& voxels, Eigen::Index point) {
  std::uint64_t key = 0;
  for (int a = 0; a < 3; ++a)  // coordinates may be −1
    key = key << 21 | static_cast<std::uint64_t>(voxels.inside(point, a) + voxels.outside(point, a) + 2);
  return key;
}

/// One of the surfaces: its points are those of the whole with the given numbers.
struct Member {
  const VoxelSurface* voxels;
  std::vector<int> number;
  Surface surface;
  std::vector<int> component;             ///< of every triangle
  std::vector<double> staircase_volumes;  ///< of the components, mm^3; cavities are negative

  void take_points(const Points& points) {
    for (std::size_t p = 0; p < number.size(); ++p) surface.points.row(p) = points.row(number[p]);
  }
};

/// All surfaces as one, a common triangle once.
struct Whole {
  Surface staircase;
  std::vector<Member> members;
};

Triangles once_each(const std::vector<std::array<int, 3>>& triangles) {
  std::vector<std::pair<std::array<int, 3>, std::size_t>> sorted;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::array<int, 3> points = triangles[t];
    std::sort(points.begin(), points.end());
    sorted.push_back({points, t});
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<char> kept(triangles.size(), 1);
  for (std::size_t n = 1; n < sorted.size(); ++n)
    if (sorted[n].first == sorted[n - 1].first) kept[sorted[n].second] = 0;
  Triangles result(std::count(kept.begin(), kept.end(), 1), 3);
  Eigen::Index row = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (kept[t]) result.row(row++) << triangles[t][0], triangles[t][1], triangles[t][2];
  return result;
}

Member member_of(const VoxelSurface& voxels) {
  Member member{&voxels, {}, voxels.surface, triangle_components(voxels.surface.triangles), {}};
  member.number.resize(static_cast<std::size_t>(voxels.surface.points.rows()));
  std::iota(member.number.begin(), member.number.end(), 0);
  member.staircase_volumes = component_volumes(member.surface, member.component);
  return member;
}

Whole unite(const std::vector<const VoxelSurface*>& voxels) {
  Whole whole;
  for (const VoxelSurface* one : voxels) whole.members.push_back(member_of(*one));
  if (voxels.size() == 1) {
    whole.staircase = voxels[0]->surface;
    return whole;
  }
  std::unordered_map<std::uint64_t, int> numbers;
  std::vector<Eigen::RowVector3d> points;
  std::vector<std::array<int, 3>> triangles;
  for (Member& member : whole.members) {
    const Surface& surface = member.voxels->surface;
    for (Eigen::Index p = 0; p < surface.points.rows(); ++p) {
      const auto [at, is_new] = numbers.try_emplace(grid_edge(*member.voxels, p), static_cast<int>(points.size()));
      if (is_new) points.push_back(surface.points.row(p));
      member.number[p] = at->second;
    }
    for (const auto& t : surface.triangles.rowwise())
      triangles.push_back({member.number[t(0)], member.number[t(1)], member.number[t(2)]});
  }
  whole.staircase.points.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t p = 0; p < points.size(); ++p) whole.staircase.points.row(static_cast<Eigen::Index>(p)) = points[p];
  whole.staircase.triangles = once_each(triangles);
  return whole;
}

/// Of the pieces of one surface; the area counts as far as its points may move.
struct PieceSizes {
  std::vector<double> volume_mm3, area_mm2;
};

PieceSizes measure_pieces(const VoxelSurface& voxels, const Surface& surface, const std::vector<char>& free) {
  PieceSizes sizes{std::vector<double>(voxels.piece_volume_mm3.size(), 0.0), {}};
  sizes.area_mm2 = sizes.volume_mm3;
  for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
    const int piece = voxels.piece(surface.triangles(t, 0));
    const Eigen::RowVector3d a = surface.points.row(surface.triangles(t, 0)),
                             b = surface.points.row(surface.triangles(t, 1)),
                             c = surface.points.row(surface.triangles(t, 2));
    const int corners = free[surface.triangles(t, 0)] + free[surface.triangles(t, 1)] + free[surface.triangles(t, 2)];
    sizes.volume_mm3[piece] += a.dot(b.cross(c)) / 6;
    sizes.area_mm2[piece] += 0.5 * (b - a).cross(c - a).norm() * (corners / 3.0);
  }
  return sizes;
}

void offset_pieces(const VoxelSurface& voxels, const std::vector<double>& step_mm, const std::vector<char>& free,
                   Surface& surface) {
  const Points normals = point_normals(surface.points, surface.triangles);
  for (Eigen::Index p = 0; p < normals.rows(); ++p)
    if (free[p]) surface.points.row(p) += step_mm[voxels.piece(p)] * normals.row(p);
}

// Moves every piece along its normals until it has the volume of its voxels, as far as the bound allows; what is then
// missing of the whole is made up by all pieces that are not at the bound.
void restore_volume(const VoxelSurface& voxels, double bound_mm, const std::vector<char>& free, Surface& surface) {
  const std::size_t pieces = voxels.piece_volume_mm3.size();
  std::vector<double> offset_mm(pieces, 0.0), step_mm(pieces, 0.0);
  for (int round = 0; round < 3; ++round) {
    const PieceSizes sizes = measure_pieces(voxels, surface, free);
    for (std::size_t i = 0; i < pieces; ++i) {
      if (sizes.area_mm2[i] <= 0) continue;  // nothing of it may move
      const double wanted = offset_mm[i] + (voxels.piece_volume_mm3[i] - sizes.volume_mm3[i]) / sizes.area_mm2[i];
      step_mm[i] = std::clamp(wanted, -bound_mm, bound_mm) - offset_mm[i];
      offset_mm[i] += step_mm[i];
    }
    offset_pieces(voxels, step_mm, free, surface);
  }
  const PieceSizes sizes = measure_pieces(voxels, surface, free);
  double missing = voxels.voxel_volume_mm3(), area = 0;
  for (std::size_t i = 0; i < pieces; ++i) {
    missing -= sizes.volume_mm3[i];
    if (std::abs(offset_mm[i]) < bound_mm) area += sizes.area_mm2[i];
  }
  if (area <= 0 || std::abs(missing) < negligible_volume * voxels.voxel_volume_mm3()) return;
  const double common_mm = std::clamp(missing / area, -0.5 * bound_mm, 0.5 * bound_mm);
  for (std::size_t i = 0; i < pieces; ++i) step_mm[i] = std::abs(offset_mm[i]) < bound_mm ? common_mm : 0;
  offset_pieces(voxels, step_mm, free, surface);
}

void restore_volumes(double bound_mm, Whole& whole, Points& points) {
  std::vector<std::size_t> order(whole.members.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return whole.members[a].voxels->voxel_volume_mm3() < whole.members[b].voxels->voxel_volume_mm3();
  });
  std::vector<char> settled(static_cast<std::size_t>(points.rows()), 0);
  for (const std::size_t n : order) {
    Member& member = whole.members[n];
    member.take_points(points);
    std::vector<char> free(member.number.size());
    for (std::size_t p = 0; p < free.size(); ++p) free[p] = !settled[member.number[p]];
    restore_volume(*member.voxels, bound_mm, free, member.surface);
    for (std::size_t p = 0; p < free.size(); ++p) {
      points.row(member.number[p]) = member.surface.points.row(p);
      settled[member.number[p]] = 1;
    }
  }
}

/// Marks the points of triangles that cross one another within a surface, and of components turned inside out, as bits
/// of a few voxels may be. @return how many pairs and components there are
std::size_t mark_faults(const Member& member, std::vector<char>& hit) {
  const auto mark = [&](Eigen::Index triangle) {
    for (int c = 0; c < 3; ++c) hit[member.number[member.surface.triangles(triangle, c)]] = 1;
  };
  const auto crossings = self_intersections(member.surface);
  for (const auto& [a, b] : crossings) {
    mark(a);
    mark(b);
  }
  const std::vector<double> volumes = component_volumes(member.surface, member.component);
  std::vector<char> turned(volumes.size());
  for (std::size_t n = 0; n < volumes.size(); ++n) turned[n] = volumes[n] * member.staircase_volumes[n] < 0;
  for (std::size_t t = 0; t < member.component.size(); ++t)
    if (turned[member.component[t]]) mark(static_cast<Eigen::Index>(t));
  return crossings.size() + static_cast<std::size_t>(std::count(turned.begin(), turned.end(), 1));
}

// Halves the displacement from the staircase around faults until there are none. @return share left per point
Eigen::VectorXd remove_faults(Whole& whole, const Points& points) {
  const Points displacement = points - whole.staircase.points;
  const auto neighbours = point_neighbours(mesh_edges(whole.staircase.triangles), points.rows());
  Eigen::VectorXd share = Eigen::VectorXd::Ones(points.rows());
  for (Member& member : whole.members) member.take_points(points);
  constexpr int most_rounds = 40;
  for (int round = 0;; ++round) {
    std::vector<char> hit(static_cast<std::size_t>(points.rows()), 0);
    std::size_t faults = 0;
    for (const Member& member : whole.members) faults += mark_faults(member, hit);
    if (faults == 0) return share;
    if (round == most_rounds)
      throw NumericalFailure(
          fmt::format("the smoothed surface crosses itself or is turned inside out in {} places and could not be "
                      "repaired; give a smaller --smooth-mm",
                      faults));
    const std::vector<char> core = hit;
    for (std::size_t p = 0; p < core.size(); ++p)
      if (core[p])
        for (const int n : neighbours[p]) hit[n] = 1;
    for (std::size_t p = 0; p < hit.size(); ++p)
      if (hit[p]) share(static_cast<Eigen::Index>(p)) *= round < most_rounds / 2 ? 0.5 : 0;
    const Points nearer = whole.staircase.points + displacement.cwiseProduct(share.replicate<1, 3>());
    for (Member& member : whole.members) member.take_points(nearer);
  }
}

}  // namespace

std::vector<std::vector<int>> touching_groups(const std::vector<const VoxelSurface*>& voxels) {
  std::vector<int> group(voxels.size());
  std::iota(group.begin(), group.end(), 0);
  std::unordered_map<std::uint64_t, int> owner;
  for (std::size_t n = 0; n < voxels.size(); ++n)
    for (Eigen::Index p = 0; p < voxels[n]->surface.points.rows(); ++p) {
      const auto [at, is_new] = owner.try_emplace(grid_edge(*voxels[n], p), static_cast<int>(n));
      const int here = group[n], there = group[at->second];
      if (here != there) std::replace(group.begin(), group.end(), std::max(here, there), std::min(here, there));
    }
  std::vector<std::vector<int>> result;
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    std::vector<int> members;
    for (std::size_t m = n; m < voxels.size(); ++m)
      if (group[m] == static_cast<int>(n)) members.push_back(static_cast<int>(m));
    if (!members.empty()) result.push_back(std::move(members));
  }
  return result;
}

std::vector<ShapedSurface> shape_together(const std::vector<const VoxelSurface*>& voxels,
                                          const ShapingOptions& options) {
  Whole whole = unite(voxels);
  FairingOptions fairing;
  fairing.spacing_mm = options.spacing_mm;
  fairing.length_mm = options.length_mm;
  Points points = fair(whole.staircase, fairing);
  restore_volumes(largest_offset_voxels * options.spacing_mm.minCoeff(), whole, points);
  const Eigen::VectorXd share = remove_faults(whole, points);
  std::vector<ShapedSurface> result;
  for (Member& member : whole.members) {
    Eigen::Index less_smooth = 0;
    for (const int n : member.number) less_smooth += share(n) < 1;
    result.push_back({std::move(member.surface), less_smooth});
  }
  return result;
}

}  // namespace supine::reconstruction
