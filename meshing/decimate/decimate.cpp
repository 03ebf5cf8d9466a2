// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/decimate/decimate.h"

#include <fmt/core.h>

#include <vector>

#include "common/error.h"
#include "meshing/decimate/methods.h"
#include "meshing/decimate/sharp_patches.h"
#include "meshing/surface/sound_surface.h"

namespace supine::meshing {
namespace {

using reconstruction::Surface;

constexpr double smallest_relative = 0.05, largest_relative = 20;

bool coarse_enough(const DecimateMeasure& measure, const DecimateOptions& options) {
  if (options.edge_mm > 0) return false;
  const Eigen::Index most = options.target_faces > 0 ? options.target_faces : options.target_triangles;
  return measure.report().triangles <= most;
}

DecimateResult unchanged(const DecimateMeasure& measure, bool reached, std::string reason) {
  DecimateResult result;
  result.surface = measure.input();
  result.reached_target = reached;
  result.reason = std::move(reason);
  measure.measure_shape(result);
  return result;
}

std::string too_many(const DecimateResult& result, const DecimateOptions& options) {
  return fmt::format(
      "{} triangles are needed to stay within {:.3g} mm of the input; allow more triangles or a larger distance",
      result.surface.triangles.rows(), options.max_distance_mm);
}

// Points that no triangle uses would be measured as if they were surface. @return whether there were any
bool drop_unused_points(const Surface& in, const DecimateOptions& options, Surface& compact, DecimateOptions& fitting) {
  std::vector<int> number(in.points.rows(), -1), kept;
  for (Eigen::Index i = 0; i < in.triangles.size(); ++i) number[in.triangles.data()[i]] = 0;
  for (int p = 0; p < static_cast<int>(number.size()); ++p)
    if (number[p] == 0) {
      number[p] = static_cast<int>(kept.size());
      kept.push_back(p);
    }
  if (kept.size() == number.size()) return false;
  compact = in;
  compact.points = Points(in.points(kept, Eigen::all));
  for (Eigen::Index i = 0; i < in.triangles.size(); ++i) compact.triangles.data()[i] = number[in.triangles.data()[i]];
  fitting = options;
  if (options.relative_size.size() > 0) fitting.relative_size = Eigen::VectorXd(options.relative_size(kept));
  return true;
}

// With the smooth pieces between sharp edges for regions, whose borders are kept.
DecimateResult decimate_sharp(const Surface& in, DecimateOptions options) {
  require_sound(in, options.open ? Borders::allowed : Borders::closed, "the surface to decimate");
  const SharpPatches patches = sharp_patches(in, options.sharp_deg);
  options.sharp_deg = 0;
  options.method = DecimateMethod::triangles;
  DecimateResult result = decimate({in.points, in.triangles, patches.patch}, options);
  Eigen::VectorXi& region = result.surface.region;
  if (in.region.size() == 0)
    region.resize(0);
  else
    for (int& row : region) row = patches.region[static_cast<std::size_t>(row)];
  return result;
}

}  // namespace

void DecimateOptions::check() const {
  if (target_triangles < 100)
    throw InputError(fmt::format("the number of triangles is {}; it must be at least 100", target_triangles));
  if (!(max_distance_mm > 0))
    throw InputError(fmt::format("the distance bound is {} mm; it must be > 0", max_distance_mm));
  if (target_faces != 0 && target_faces < 50)
    throw InputError(fmt::format("the number of faces is {}; it must be 0 or at least 50", target_faces));
  if (sharp_deg != 0 && !(sharp_deg >= 1 && sharp_deg <= 179))
    throw InputError(fmt::format("the angle of sharp edges is {} degrees; it must lie in [1, 179]", sharp_deg));
  if (!(edge_mm >= 0)) throw InputError(fmt::format("the edge length is {} mm; it must be > 0", edge_mm));
  for (Eigen::Index p = 0; p < relative_size.size(); ++p)
    if (!(relative_size(p) >= smallest_relative && relative_size(p) <= largest_relative))
      throw InputError(fmt::format("the relative size of point {} is {}; it must lie in [{}, {}]", p, relative_size(p),
                                   smallest_relative, largest_relative));
}

namespace {

/// So short edges would take hours, and more memory than there is.
void check_edges(const Surface& in, double edge_mm) {
  if (edge_mm == 0) return;
  constexpr double most_triangles = 2e6;
  double area_mm2 = 0;
  for (Eigen::Index t = 0; t < in.triangles.rows(); ++t) {
    const Eigen::Vector3d a = in.points.row(in.triangles(t, 0)), b = in.points.row(in.triangles(t, 1)),
                          c = in.points.row(in.triangles(t, 2));
    area_mm2 += (b - a).cross(c - a).norm() / 2;
  }
  const double triangles = area_mm2 / (0.433 * edge_mm * edge_mm);  // √3/4 of the edge's square each
  if (triangles > most_triangles)
    throw InputError(fmt::format("edges of {:g} mm make {:.2g} triangles of this surface; at most {:g}: take {:.2g} mm",
                                 edge_mm, triangles, most_triangles, std::sqrt(area_mm2 / (0.433 * most_triangles))));
}

}  // namespace

DecimateResult decimate(const Surface& in, const DecimateOptions& options) {
  options.check();
  check_edges(in, options.edge_mm);
  if (options.sharp_deg > 0) return decimate_sharp(in, options);
  SoundSurface sound = require_sound(in, options.open ? Borders::allowed : Borders::closed, "the surface to decimate");
  if (options.relative_size.size() != 0 && options.relative_size.size() != in.points.rows())
    throw InputError(fmt::format("there are {} relative sizes for {} points of the surface; one each is needed",
                                 options.relative_size.size(), in.points.rows()));
  Surface compact;
  DecimateOptions fitting;
  if (drop_unused_points(in, options, compact, fitting)) return decimate(compact, fitting);
  const DecimateMeasure measure(in, std::move(sound));
  if (coarse_enough(measure, options)) return unchanged(measure, true, "");
  DecimateResult result;
  std::string fallback;
  if (options.method == DecimateMethod::quads) {
    result = decimate_to_quads(measure, options);
    if (result.surface.triangles.rows() == 0) fallback = "no sound quads within the bound: " + result.reason;
  }
  if (result.surface.triangles.rows() == 0) result = decimate_to_triangles(measure, options);
  if (result.surface.triangles.rows() == 0)
    result = unchanged(
        measure, false,
        "no coarser surface stays within the bound without crossing itself (" + result.reason +
            "); the input is returned: allow a larger distance, or smooth it more (supine-reconstruct --smooth-mm)");
  else if (!result.reached_target)
    result.reason = too_many(result, options);
  result.fallback = fallback;
  measure.measure_shape(result);
  return result;
}

DecimateResult decimate_within(const Surface& in, const std::vector<double>& looser_mm, DecimateOptions& options) {
  double grown = 1.5;  // of the number asked for: less of it is worth its nearness
  DecimateResult result = decimate(in, options);
  for (const double bound_mm : looser_mm) {
    const auto triangles = static_cast<double>(result.surface.triangles.rows());
    if (!(bound_mm > options.max_distance_mm) || triangles < grown * options.target_triangles) return result;
    DecimateOptions looser = options;
    looser.max_distance_mm = bound_mm;
    DecimateResult other = decimate(in, looser);
    grown = 2;
    if (other.surface.triangles.rows() >= result.surface.triangles.rows()) continue;
    options = looser;
    result = std::move(other);
  }
  return result;
}

}  // namespace supine::meshing
