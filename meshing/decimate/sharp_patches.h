// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// The smooth pieces of a surface: triangles of one region that hang together over edges that are not sharp.
struct SharpPatches {
  Eigen::VectorXi patch;    ///< #T, from 0
  std::vector<int> region;  ///< of each patch; 0 where the surface has none
};

/// @param surface    manifold
/// @param sharp_deg  normals that meet at more than this part two pieces
SharpPatches sharp_patches(const reconstruction::Surface& surface, double sharp_deg);

}  // namespace supine::meshing
