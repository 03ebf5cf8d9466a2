// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "reconstruction/surface.h"

namespace supine::reconstruction {

/// The health of a surface, in numbers; the same for people, tests and sidecars.
struct SurfaceReport {
  Eigen::Index points = 0;  ///< that a triangle uses
  Eigen::Index triangles = 0;
  Eigen::Index border_edges = 0;  ///< edges of one triangle only
  Eigen::Index bad_edges = 0;     ///< edges of three or more triangles, or of two that disagree on orientation
  Eigen::Index bad_points = 0;    ///< points whose triangles do not form one fan
  int components = 0;             ///< connected pieces of surface
  int cavities = 0;               ///< closed pieces that enclose a negative volume (holes inside a body)
  Eigen::Index euler = 0;         ///< points − edges + triangles
  double volume_mm3 = 0;          ///< signed, of a closed surface; > 0 when oriented outward
  double area_mm2 = 0;
  std::array<double, region_names.size()> region_area_mm2{};  ///< by Region; all of it under none without regions
  int first_bad_point = -1;                                   ///< a point of the first bad edge or bad point

  bool closed() const { return border_edges == 0 && bad_edges == 0; }
  bool manifold() const { return bad_edges == 0 && bad_points == 0; }
  /// Handles of all pieces together; meaningful for closed manifold surfaces.
  Eigen::Index genus() const { return components - euler / 2; }
};

SurfaceReport check_surface(const Surface& surface);

/// Connected piece of every triangle (pieces share an edge), numbered from 0 in the order of their first triangle.
std::vector<int> triangle_components(const Triangles& triangles);

/// Signed volume of each piece, mm³. @param component  as triangle_components returns it
std::vector<double> component_volumes(const Surface& surface, const std::vector<int>& component);

/// All pairs of triangles that intersect beyond what they share, in ascending order (exact predicates).
/// @pre  manifold
std::vector<std::pair<int, int>> self_intersections(const Surface& surface);

/// Stops anything but a closed, manifold, outward surface without self-intersections.
/// @param what  names the surface in the message, for example its file
/// @throws InputError  saying what is wrong, how often, and the first place in mm
void require_solid(const Surface& surface, const std::string& what);

}  // namespace supine::reconstruction
