// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// Where a surface must be finer than elsewhere.
struct FinePlace {
  Eigen::Vector3d point_mm;
  int level;  ///< >= 1; edges are edge_mm / 2^level there
};

/// Isotropic remeshing with region borders kept, each level of fineness remeshed in its turn, finest first.
/// @param surface  closed manifold, with regions (or none, then it is one region)
/// @param edge_mm  edge length away from the fine places, > 0
/// @param iterations  rounds of splitting, collapsing, flipping and moving; one coarsens, five make good triangles
/// @return triangles of @p surface's regions; the topology is that of @p surface
reconstruction::Surface remesh(const reconstruction::Surface& surface, double edge_mm,
                               const std::vector<FinePlace>& fine, unsigned int iterations = 5);

/// The same for the fine places alone, coarsest level first: a place of level n claims what lies within 2 edge_mm / 2^n
/// of it, and triangles no place claims stay as they are but for edges split on the band's rim.
reconstruction::Surface refine(const reconstruction::Surface& surface, double edge_mm,
                               const std::vector<FinePlace>& fine);

}  // namespace supine::meshing
