// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/scan.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/surface_topology.h"
#include "common/error.h"
#include "common/statistics.h"

namespace supine::calibration {
namespace {

constexpr double far_mm = 30;
constexpr double flip_from_mm = 10;
constexpr double flip_gain = 3;
constexpr double flip_gain_from_behind = 1.5;  // a scan behind the muscle is wrong anyway: less proof is needed
constexpr double most_behind = 0.5;
constexpr int least_over_muscle = 20;  // fewer scan points say nothing about which side of the muscle the scan is on

void check_extent(const Points& points, const std::string& name) {
  if (!points.allFinite()) throw InputError(fmt::format("{}: a coordinate is not a finite number", name));
  const double extent = (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
  if (extent < Scan::least_extent_mm) {
    throw InputError(
        fmt::format("{}: its bounding box has a diagonal of {:.4g} mm, expected at least {} mm. It looks as if it "
                    "were in metres: multiply the coordinates by 1000",
                    name, extent, Scan::least_extent_mm));
  }
  if (extent > Scan::most_extent_mm) {
    throw InputError(fmt::format(
        "{}: its bounding box has a diagonal of {:.4g} mm, expected at most {} mm: write the coordinates in mm", name,
        extent, Scan::most_extent_mm));
  }
}

void check_size(const reconstruction::Surface& surface, const std::string& name) {
  const Eigen::Index points = surface.points.rows(), triangles = surface.triangles.rows();
  if (triangles == 0 && points < Scan::least_points) {
    throw InputError(
        fmt::format("{}: {} points without triangles; a comparison needs at least {} points or {} "
                    "triangles",
                    name, points, Scan::least_points, Scan::least_triangles));
  }
  if (triangles > 0 && triangles < Scan::least_triangles) {
    throw InputError(fmt::format("{}: {} triangles; a comparison needs at least {} triangles or {} bare points", name,
                                 triangles, Scan::least_triangles, Scan::least_points));
  }
}

// The surface without points that no triangle uses: nothing was measured there.
reconstruction::Surface used_part(const reconstruction::Surface& surface, const std::string& name) {
  std::vector<int> row(surface.points.rows(), -1);
  for (const int node : surface.triangles.reshaped()) {
    if (node < 0 || node >= surface.points.rows()) {
      throw InputError(
          fmt::format("{}: a triangle names point {}, the file has 0..{}", name, node, surface.points.rows() - 1));
    }
    row[node] = 0;
  }
  std::vector<int> kept;
  for (int i = 0; i < surface.points.rows(); ++i) {
    if (row[i] < 0) continue;
    row[i] = static_cast<int>(kept.size());
    kept.push_back(i);
  }
  reconstruction::Surface used{surface.points(kept, Eigen::all), surface.triangles, {}};
  for (int& node : used.triangles.reshaped()) node = row[node];
  return used;
}

// Turns over each piece whose normals point against the model's, by area.
void turn_outward(const std::vector<int>& piece, const Points& points, const ModelSkin& model, Triangles& triangles) {
  Points centres(triangles.rows(), 3), normals(triangles.rows(), 3);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Eigen::Vector3d a = points.row(triangles(t, 0)), b = points.row(triangles(t, 1)),
                          c = points.row(triangles(t, 2));
    centres.row(t) = (a + b + c) / 3;
    normals.row(t) = (b - a).cross(c - a);
  }
  ClosestPoints closest;
  model.closest(centres, closest);
  std::vector<double> vote(*std::max_element(piece.begin(), piece.end()) + 1, 0.0);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) vote[piece[t]] += normals.row(t).dot(closest.normal.row(t));
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    if (vote[piece[t]] < 0) std::swap(triangles(t, 1), triangles(t, 2));
  }
}

SurfaceDistance prepared(const reconstruction::Surface& surface, const ModelSkin& model, const std::string& name) {
  check_size(surface, name);
  if (surface.triangles.rows() == 0) {
    check_extent(surface.points, name);
    return {surface.points, surface.triangles};
  }
  reconstruction::Surface used = used_part(surface, name);
  check_extent(used.points, name);
  const auto piece = orient_pieces(SurfaceTopology(used.points, used.triangles), used.triangles);
  turn_outward(piece, used.points, model, used.triangles);
  return {used.points, used.triangles};
}

Points flipped(const Points& points) { return points * Eigen::Vector3d(-1, -1, 1).asDiagonal(); }

// The smaller of the median distances scan → skin and skin → scan. Flipping the skin instead of the scan in the
// second leaves the distance as it is, because diag(−1, −1, 1) is its own inverse.
double median_distance_mm(const Scan& scan, const ModelSkin& model, bool flip) {
  ClosestPoints closest;
  model.closest(flip ? flipped(scan.points()) : scan.points(), closest);
  const double to_skin = median(closest.distance_mm);
  scan.distance().closest(flip ? flipped(model.node_points()) : model.node_points(), closest);
  return std::min(to_skin, median(closest.distance_mm));
}

double share_behind(const Scan& scan, const reconstruction::Surface& muscle) {
  if (muscle.triangles.rows() == 0) return 0;
  ClosestPoints closest;
  SurfaceDistance(muscle.points, muscle.triangles).closest(scan.points(), closest);
  int over = 0, behind = 0;
  for (Eigen::Index i = 0; i < scan.points().rows(); ++i) {
    if (closest.on_border[i]) continue;
    ++over;
    behind += (scan.points().row(i) - closest.point.row(i)).dot(closest.normal.row(i)) < 0;
  }
  return over < least_over_muscle ? 0 : static_cast<double>(behind) / over;
}

}  // namespace

Scan::Scan(const reconstruction::Surface& surface, const ModelSkin& model, const std::string& name)
    : distance_(prepared(surface, model, name)) {}

void check_frame(const Scan& scan, const ModelSkin& model, const reconstruction::Surface& muscle,
                 const std::string& name) {
  const double as_is = median_distance_mm(scan, model, false);
  const double behind = share_behind(scan, muscle);
  if (as_is <= flip_from_mm && behind <= most_behind) return;
  const double negated = median_distance_mm(scan, model, true);
  if (negated * (behind > most_behind ? flip_gain_from_behind : flip_gain) < as_is) {
    throw InputError(fmt::format(
        "{}: lies {:.1f} mm from the model's skin (median){}; with x and y negated it "
        "lies {:.1f} mm from it. Its coordinates are in the other frame: where the file names its frame (PLY, OBJ: a "
        "comment line \"frame RAS, unit mm\"; STL: SPACE=), correct that; where it names none, add it, or negate x and "
        "y",
        name, as_is, muscle.triangles.rows() > 0 ? fmt::format(", {:.0f} % of it behind the muscle", 100 * behind) : "",
        negated));
  }
}

void check_placement(const Scan& scan, const ModelSkin& model, const reconstruction::Surface& muscle,
                     const std::string& name) {
  check_frame(scan, model, muscle, name);
  const double as_is = median_distance_mm(scan, model, false);
  if (as_is > far_mm) {
    throw InputError(
        fmt::format("{}: lies {:.1f} mm from the model's skin (median; bound {} mm; {:.1f} mm with x and y negated). "
                    "Bring the scan into the frame of the image (LPS, mm)",
                    name, as_is, far_mm, median_distance_mm(scan, model, true)));
  }
  const double behind = share_behind(scan, muscle);
  if (behind > most_behind) {
    throw InputError(
        fmt::format("{}: {:.0f} % of its points over the chest muscle lie behind it (bound {:.0f} %). Check the frame "
                    "of the scan against that of the image (LPS, mm)",
                    name, 100 * behind, 100 * most_behind));
  }
}

}  // namespace supine::calibration
