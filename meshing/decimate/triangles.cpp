// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "meshing/decimate/methods.h"
#include "meshing/surface/remesh.h"
#include "reconstruction/surface_check.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;

constexpr int most_levels = 3;       // edges down to 1/8 of the coarsest
constexpr double start_share = 0.2;  // edges of what is remeshed again and again, of the coarsest
constexpr int most_tries = 16;
constexpr double shortest_share = 0.7;  // of the first edge length, below which no sound surface is looked for

// Every place goes one level below the finest level that claims it already. @return whether any is not at the finest
bool add_places(const std::vector<Eigen::Vector3d>& places, double edge_mm, std::vector<FinePlace>& fine) {
  const std::size_t before = fine.size();
  bool finer = false;
  for (const Eigen::Vector3d& at : thinned(places, edge_mm / 4)) {
    int level = 0;
    for (std::size_t i = 0; i < before; ++i)
      if ((fine[i].point_mm - at).norm() < 2 * edge_mm / std::exp2(fine[i].level))
        level = std::max(level, fine[i].level);
    finer = finer || level < most_levels;
    // The coarser levels surround the finer ones, so that edges grow step by step.
    for (int l = 1; l <= std::min(level + 1, most_levels); ++l) fine.push_back({at, l});
  }
  return finer;
}

// One remeshing at a given coarseness, refined until the bound holds. @return whether it is sound and within the bound
bool refine_to_bound(const DecimateMeasure& measure, const Surface& start, double edge_mm,
                     const DecimateOptions& options, DecimateResult& result) {
  std::vector<FinePlace> fine;
  for (int round = 0; round <= most_levels + 1; ++round) {
    result.surface = remesh(start, edge_mm, fine);
    measure.give_volume_back(result.surface);
    if (!measure.same_topology(result.surface)) {
      result.reason = "isotropic remeshing changes the topology";
      return false;
    }
    std::vector<Eigen::Vector3d> places = measure.places_too_far(options.max_distance_mm, result);
    const std::vector<Eigen::Vector3d> unsound = measure.unsound_places(result.surface);
    if (places.empty() && unsound.empty()) return true;
    places.insert(places.end(), unsound.begin(), unsound.end());
    result.reason =
        fmt::format("isotropic remeshing leaves the bound or crosses itself near ({:.1f}, {:.1f}, {:.1f}) mm",
                    places.front().x(), places.front().y(), places.front().z());
    if (!add_places(places, edge_mm, fine)) return false;
  }
  return false;
}

}  // namespace

DecimateResult decimate_to_triangles(const DecimateMeasure& measure, const DecimateOptions& options) {
  const Surface& in = measure.input();
  // Equilateral triangles of that edge would give the target; those of the remeshing come out a tenth smaller.
  int target = options.target_triangles;
  if (options.target_faces > 0) target = 2 * options.target_faces;
  double edge_mm = 1.12 * std::sqrt(4 * measure.report().area_mm2 / (std::numbers::sqrt3 * target));
  if (options.edge_mm > 0) {
    edge_mm = options.edge_mm;
    target = std::max(100, static_cast<int>(4 * measure.report().area_mm2 / (std::numbers::sqrt3 * edge_mm * edge_mm)));
  }
  Surface start = in;
  const auto start_triangles = static_cast<Eigen::Index>(target / (start_share * start_share));
  const double shortest_mm = shortest_share * edge_mm;
  if (in.triangles.rows() > 2 * start_triangles) start = remesh(in, start_share * edge_mm, {}, 1);
  DecimateResult best;
  for (int attempt = 0; attempt < most_tries; ++attempt) {
    if (options.progress)
      options.progress(
          fmt::format("triangles, attempt {} of at most {}, edges {:.1f} mm", attempt + 1, most_tries, edge_mm));
    DecimateResult result;
    if (!refine_to_bound(measure, start, edge_mm, options, result)) {
      edge_mm *= 0.8;
      if (best.surface.triangles.rows() > 0) break;
      best.reason = result.reason;
      if (edge_mm < shortest_mm) break;
      continue;
    }
    const auto triangles = result.surface.triangles.rows();
    const auto best_triangles = best.surface.triangles.rows();
    const bool fits = triangles <= target, best_fits = best.reached_target;
    if (best_triangles == 0 || (fits && (!best_fits || triangles > best_triangles)) ||
        (!fits && !best_fits && triangles < best_triangles)) {
      best = std::move(result);
      best.reached_target = fits;
    }
    if ((fits && triangles >= 0.9 * target) || attempt >= 5) break;
    edge_mm *= std::sqrt(static_cast<double>(triangles) / (0.95 * target));
  }
  return best;
}

}  // namespace supine::meshing
