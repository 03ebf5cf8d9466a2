// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "reconstruction/surface.h"

namespace supine::meshing {

/// Triangles joined two by two to quads.
struct QuadPairs {
  Eigen::VectorXi quad;  ///< by triangle: its quad, numbered from 0 without gaps; −1 for a triangle alone
  int quads = 0, alone = 0;
  int faces() const { return quads + alone; }
};

/// Joins neighbouring triangles of one region to quads whose angles lie in [90 − @p largest_deviation_deg, 90 + the
/// same] and that bend little: the squarest first, then along alternating paths while that leaves fewer triangles
/// alone. Ties go to lower numbers. @pre  manifold
QuadPairs pair_triangles(const reconstruction::Surface& surface, double largest_deviation_deg = 60);

/// Largest deviation of a quad's four angles from 90 degrees, by quad.
Eigen::VectorXd quad_deviations_deg(const reconstruction::Surface& surface, const QuadPairs& pairs);

}  // namespace supine::meshing
