// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "common/arrays.h"
#include "meshing/tetrahedra/size_field.h"
#include "reconstruction/surface.h"

namespace supine::meshing {

/// What TetGen made of a surface.
struct TetgenResult {
  Points points;            ///< the surface's points first
  Indices cells;            ///< #C by 4, positive volume
  Eigen::VectorXi chamber;  ///< #C; cells that no triangle of the surface separates have the same number
};

struct TetgenBounds {
  double radius_edge, min_dihedral_deg, max_volume_mm3;
};

/// Fills the hull of a surface without self-intersections, its triangles kept.
/// @param sizes  edge lengths wanted in space; none when null
/// @throws NumericalFailure  with what TetGen's error number means
TetgenResult call_tetgen(const reconstruction::Surface& surface, const TetgenBounds& bounds,
                         const SizeField* sizes = nullptr);

}  // namespace supine::meshing
