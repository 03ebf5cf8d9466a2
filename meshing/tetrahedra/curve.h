// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/anatomy/muscle_distance.h"
#include "meshing/tet_mesh.h"
#include "reconstruction/surface.h"

namespace supine::meshing {

struct CurveOptions {
  /// Scaled Jacobian that a cell of straight edges' shape keeps everywhere when its edges curve, in (0, 1). A middle
  /// node is pulled back toward the middle of its straight edge until its cells do.
  double least_jacobian = 0.3;
  /// Neighbourhood a point of the fine surface is averaged over (quadratic fit), as a share of the mean edge around the
  /// node, in [0, 2]; 0 = the fine triangles themselves.
  double smooth_share = 0.6;
  /// How far off the fine surface the muscle's smooth zero level is followed, mm, >= 0.
  double muscle_reach_mm = 0.5;
  void check() const;  ///< @throws InputError naming option, value and bound
};

/// Distances of a mesh's boundary (36 points per face, curved faces as they are) to the fine surface.
struct SurfaceDistance {
  double mean_mm = 0, rms_mm = 0, max_mm = 0;
};

struct CurveReport {
  SurfaceDistance before, after;            ///< of the straight mesh of the coarse surface, and of the curved one
  SurfaceDistance skin_before, skin_after;  ///< skin faces alone
  double volume_before_ml = 0, volume_after_ml = 0, fine_volume_ml = 0;
  Eigen::Index corners = 0, middles = 0;           ///< boundary nodes
  double corner_shift_max_mm = 0;                  ///< corners moved onto the surface
  double sagitta_mean_mm = 0, sagitta_max_mm = 0;  ///< middles off their straight edges' middles, as kept
  Eigen::Index corners_pulled_back = 0, middles_pulled_back = 0;
  double pulled_back_max_mm = 0;   ///< a node ends so far from where the surface wants it
  double pulled_back_mean_mm = 0;  ///< over the nodes pulled back
};

/// Bends the boundary of a quadratic mesh onto the fine surface it approximates. Corners and middle nodes of boundary
/// faces go to the surface of their region, on a region border to the border's curve, where three regions meet they
/// stay; inner ones then go on along the muscle's normal to its smooth zero level @p muscle, on which the tissue
/// slides. Inner edges stay straight. Every cell ends with a scaled Jacobian above options.least_jacobian throughout,
/// proved by Bernstein bounds, corner shapes no worse than 0.8 of what they were.
/// @param mesh  quadratic, straight edges; same numbers and regions afterwards, points moved
/// @param fine  the closed surface with regions that the mesh's faces were decimated from, mm, LPS
/// @param muscle  zero level the inner faces follow; null = they follow @p fine
/// @throws InputError  mesh is not quadratic, fine carries no regions or lies elsewhere, option out of range
CurveReport curve_boundary(TetMesh& mesh, const reconstruction::Surface& fine, const MuscleDistance* muscle,
                           const CurveOptions& options = {});

}  // namespace supine::meshing
