// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "meshing/surface/triangle_tree.h"
#include "reconstruction/surface_check.h"

namespace supine::meshing {

enum class Borders {
  closed,  ///< there must be none
  allowed  ///< open borders are part of the surface
};

/// What the check has found out on its way, for those who go on with the surface.
struct SoundSurface {
  reconstruction::SurfaceReport report;
  std::shared_ptr<const TriangleTree> tree;  ///< of its triangles
};

/// Stops every surface that meshing cannot take for what it seems, before any work is done: no triangles; a point that
/// is not finite; a triangle with a point there is not, with the same point twice, or without area; more than two
/// sheets at an edge or point, or sheets that disagree on their orientation; open edges where there must be none;
/// triangles that intersect; a closed piece that faces the wrong way (inward, or one body inside another).
/// Points no triangle uses are no fault.
/// @param what  names the surface in the message
/// @throws InputError  what is wrong, how often, the first place in mm and what to do
SoundSurface require_sound(const reconstruction::Surface& surface, Borders borders, const std::string& what);

/// How often the surface goes round a point: 1 inside a closed outward surface, 0 outside (solid angles after van
/// Oosterom and Strackee 1983, eq. 8).
double winding_number(const Points& points, const Triangles& triangles, const Eigen::Vector3d& at);

}  // namespace supine::meshing
