// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "meshing/decimate/methods.h"
#include "meshing/quads/quad_remesh.h"

namespace supine::meshing {
namespace {

constexpr int most_rounds = 12;
constexpr int rounds_at_target = 4;  // refinements at the number asked for; then the number grows
constexpr double refinement = 0.7;   // of the edge length where the bound is broken
constexpr double growth = 1.2;
constexpr double largest_growth = 3;
constexpr double many_places = 0.1;  // share of cells too far away from which the number is too small everywhere

DecimateResult filled(QuadMesh&& mesh) {
  DecimateResult result;
  result.surface = std::move(mesh.surface);
  result.quad = std::move(mesh.pairs.quad);
  result.quads = mesh.pairs.quads;
  result.alone = mesh.pairs.alone;
  return result;
}

Points as_points(const std::vector<Eigen::Vector3d>& places) {
  Points points(static_cast<Eigen::Index>(places.size()), 3);
  for (std::size_t i = 0; i < places.size(); ++i) points.row(static_cast<Eigen::Index>(i)) = places[i].transpose();
  return points;
}

void enlarge(QuadTarget& target, double factor) {
  target.triangles = static_cast<int>(std::ceil(target.triangles * factor));
  target.faces = static_cast<int>(std::ceil(target.faces * factor));
  target.edge_mm /= std::sqrt(factor);
}

}  // namespace

DecimateResult decimate_to_quads(const DecimateMeasure& measure, const DecimateOptions& options) {
  const reconstruction::Surface& in = measure.input();
  QuadTarget target;
  double edge_mm = options.edge_mm;
  if (options.edge_mm > 0) {
    target.edge_mm = options.edge_mm;
  } else {
    (options.target_faces > 0 ? target.faces : target.triangles) =
        options.target_faces > 0 ? options.target_faces : options.target_triangles;
    edge_mm = edge_for_triangles(in, options.relative_size, target.faces > 0 ? 2 * target.faces : target.triangles);
  }
  const QuadTarget asked = target;
  QuadRemesher remesher(in, options.relative_size, edge_mm, measure.tree());
  DecimateResult failed;
  for (int round = 0; round < most_rounds; ++round) {
    if (options.progress)
      options.progress(fmt::format("quads, attempt {} of at most {}{}", round + 1, most_rounds,
                                   failed.reason.empty() ? "" : "; the last one: " + failed.reason));
    QuadMesh mesh = remesher.make(target);
    measure.give_volume_back(mesh.surface);
    std::vector<Eigen::Vector3d> places = measure.unsound_places(mesh.surface);
    if (!places.empty()) {
      remesher.even_out(places, mesh);
      places = measure.unsound_places(mesh.surface);
    }
    DecimateResult result = filled(std::move(mesh));
    const std::vector<Eigen::Vector3d> far = measure.places_too_far(options.max_distance_mm, result);
    const bool same = measure.same_topology(result.surface);
    if (same && far.empty() && places.empty()) {
      const double count = asked.triangles > 0 ? static_cast<double>(result.surface.triangles.rows()) / asked.triangles
                           : asked.faces > 0   ? (result.quads + result.alone) / (1.02 * asked.faces)
                                               : asked.edge_mm / target.edge_mm;
      result.reached_target = count <= 1;
      return result;
    }
    const Eigen::Vector3d first =
        places.empty() ? (far.empty() ? Eigen::Vector3d::Zero().eval() : far.front()) : places.front();
    failed.reason = fmt::format("{} at ({:.1f}, {:.1f}, {:.1f}) mm",
                                places.empty() ? fmt::format("distance {:.2f} mm", result.distance_mm)
                                               : std::string("quads cross each other or turn over"),
                                first.x(), first.y(), first.z());
    // Attempts become dearer with their triangles, and more than the surface has are of no use.
    if (result.surface.triangles.rows() > in.triangles.rows()) {
      failed.reason += fmt::format(", with {} triangles of {} that the surface has", result.surface.triangles.rows(),
                                   in.triangles.rows());
      return failed;
    }
    places.insert(places.end(), far.begin(), far.end());
    const std::vector<Eigen::Vector3d> spread = thinned(places, edge_mm);
    const double cells = measure.report().area_mm2 / (edge_mm * edge_mm);
    if (static_cast<double>(spread.size()) > many_places * cells)
      enlarge(target, std::clamp(result.distance_mm / options.max_distance_mm, growth, largest_growth));
    else if (round >= rounds_at_target)
      enlarge(target, growth);
    if (static_cast<double>(spread.size()) <= 0.5 * cells) remesher.refine(as_points(spread), refinement, edge_mm);
  }
  return failed;
}

}  // namespace supine::meshing
