// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "reconstruction/surface.h"

namespace supine::meshing {

enum class DecimateMethod {
  quads,     ///< field-aligned quad-dominant remeshing, fitted to the input; triangles where that fails
  triangles  ///< isotropic remeshing (Botsch and Kobbelt 2004, by CGAL)
};

/// How coarse, and how far from its input, a decimated surface may be.
struct DecimateOptions {
  int target_triangles = 3000;   ///< aimed at from below; >= 100
  double max_distance_mm = 1.0;  ///< between input and output, either way; > 0
  int target_faces = 0;          ///< quads and lone triangles, within 2 %; 0 = by triangles, else >= 50
  double edge_mm = 0;            ///< edge length aimed at; 0 = by number, else > 0
  DecimateMethod method = DecimateMethod::quads;
  /// Wanted edge length by point of the input, as a factor of the common one, in [0.05, 20]; empty = 1 everywhere.
  Eigen::VectorXd relative_size = {};
  /// Edges at which faces meet at more than this stay where they are (CAD bodies), degrees, in [1, 179]; triangles are
  /// then of one size. 0 = none is kept for its own sake.
  double sharp_deg = 0;
  bool open = false;  ///< open borders are allowed, and kept as chains of edges
  /// Called before each attempt with a line that says which; may be empty.
  std::function<void(const std::string&)> progress = {};

  void check() const;  ///< @throws InputError naming option, value and bound
};

struct DecimateResult {
  reconstruction::Surface
      surface;                    ///< closed, manifold, outward, no self-intersections; every triangle with its region
  Eigen::VectorXi quad;           ///< by triangle: the quad it is half of, from 0; −1 for a triangle alone
  int quads = 0, alone = 0;       ///< quads and triangles alone
  double distance_mm = 0;         ///< largest distance found, the larger of the next two; <= max_distance_mm
  double to_input_mm = 0;         ///< output → input, over a dense sampling of the output
  double from_input_mm = 0;       ///< input → output, over the input's points and a dense sampling of its triangles
  double mean_to_input_mm = 0;    ///< mean over the same samples
  double mean_from_input_mm = 0;  ///< mean over the same samples
  double border_mm = 0;           ///< region borders and open borders: output → input; <= max_distance_mm
  double volume_change = 0;       ///< relative to the input; 0 for an open surface
  double edge_mm = 0;             ///< mean edge length, diagonals of quads left out
  double smallest_angle_deg = 0;  ///< of all triangles
  double mean_deviation_deg = 0;  ///< of the quads' largest deviations from 90 degrees
  bool reached_target = false;    ///< at most target_triangles (or the faces or edge length asked for)
  std::string reason;             ///< why not, empty when reached
  std::string fallback;           ///< why there are no quads although they were asked for; empty otherwise
};

/// Decimates to a quad-dominant surface (QuadRemesher), smaller faces where the bound asks for it.
///
/// Where input and output are further apart than the bound, or the output would cross itself, faces become smaller
/// there, again and again; the rest becomes coarser so that the number asked for is kept while that is possible, then
/// it grows. When that finds nothing sound, isotropic triangles are tried, then the input is returned; fallback and
/// reason say so with places in mm. Region borders stay chains of edges.
/// @param in  closed (or open where allowed), manifold, outward, without self-intersections; with regions or without
/// @post  components and Euler characteristic are those of @p in; the same bytes for any number of threads
/// @throws InputError  in is not such a surface (names the first place), options out of range
DecimateResult decimate(const reconstruction::Surface& in, const DecimateOptions& options);

/// The same, and where that takes half as many triangles again as are asked for, within the first of @p looser_mm;
/// where that takes twice as many, within the next. For a surface whose cells are bent onto the input afterwards, of
/// which the distance of flat triangles is not what they will err by.
/// @param looser_mm  ascending
/// @param options  out: max_distance_mm is the bound that holds
DecimateResult decimate_within(const reconstruction::Surface& in, const std::vector<double>& looser_mm,
                               DecimateOptions& options);

}  // namespace supine::meshing
