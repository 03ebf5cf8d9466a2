// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// How coarse, and how far from its input, a decimated surface may be.
struct DecimateOptions {
  int target_triangles = 3000;   ///< aimed at from below; >= 100
  double max_distance_mm = 1.0;  ///< between input and output, either way; > 0

  void check() const;  ///< @throws InputError naming option, value and bound
};

struct DecimateResult {
  reconstruction::Surface
      surface;               ///< closed, manifold, outward, no self-intersections; every triangle with its region
  double distance_mm = 0;    ///< largest distance found, the larger of the next two; <= max_distance_mm
  double to_input_mm = 0;    ///< output → input, over points, edge middles and centroids
  double from_input_mm = 0;  ///< input → output, over all points of the input
  double border_mm = 0;      ///< region borders: output → input, over points and edge middles; <= max_distance_mm
  double volume_change = 0;  ///< relative to the input
  double edge_mm = 0;        ///< mean edge length
  double smallest_angle_deg = 0;  ///< of all triangles
  bool reached_target = false;    ///< at most target_triangles
  std::string reason;             ///< why not, empty when reached
};

/// Decimates to well-shaped triangles of one size, smaller where the bound asks for it.
///
/// Isotropic remeshing (Botsch and Kobbelt 2004, by CGAL) at the edge length the target gives; where input and output
/// are further apart than the bound, the input is kept at half that edge length, again and again. Chords lie inside a
/// convex surface: an offset along the normals gives the volume back. Region borders stay chains of edges. A finer
/// surface than asked for is returned, with the reason, where the bound or a self-intersection leaves no choice.
/// @param in  closed, manifold, outward, without self-intersections; with regions or without
/// @post  components and Euler characteristic are those of @p in
/// @throws InputError  in is not such a surface (names the first place), options out of range
DecimateResult decimate(const reconstruction::Surface& in, const DecimateOptions& options);

}  // namespace supine::meshing
