// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "meshing/surface/triangle_tree.h"
#include "reconstruction/surface.h"

namespace supine::meshing {

/// Pairs of triangles that intersect beyond what they share, ascending: reconstruction::self_intersections(), for large
/// surfaces. Pairs whose boxes touch are first looked at in doubles with bounds of the rounding; what these cannot
/// clear goes to the exact predicates.
/// @param tree  of the surface's triangles
/// @pre  manifold
std::vector<std::pair<int, int>> crossings(const reconstruction::Surface& surface, const TriangleTree& tree);

}  // namespace supine::meshing
