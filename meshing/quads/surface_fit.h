// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>

#include "meshing/quads/field_mesh.h"
#include "meshing/quads/quad_pairs.h"
#include "meshing/surface/triangle_tree.h"

namespace supine::meshing {

/// What a coarse surface is fitted to: points of the input with normals and areas, its region borders and open borders.
struct FitTarget {
  /// @param most_samples  about so many points of the input are used, evenly chosen
  /// @param input_tree  of the input, where there is one already
  FitTarget(const reconstruction::Surface& input, int most_samples,
            std::shared_ptr<const TriangleTree> input_tree = nullptr);

  std::shared_ptr<const TriangleTree> tree;  ///< of the input
  Points points, normals;
  Eigen::VectorXd area_mm2;
  Points border_points, border_tangents;  ///< samples of the borders
  double border_mm = 0;                   ///< length one sample stands for
  std::unique_ptr<TriangleTree> border;   ///< of the borders' edges; none without
};

struct FitOptions {
  int rounds = 6;
  double smoothing = 0.03;  ///< share of the tangential smoothing, > 0; less lets points follow detail
  double square = 0.01;     ///< share that keeps quads parallelograms, >= 0
  double emphasis = 0;      ///< 0: least squares; > 0: distant places count more, so that the largest distance falls
};

/// Moves points to the closest points of the input, those on borders to the closest points of its borders.
void project(const FitTarget& target, reconstruction::Surface& surface);

/// Evens out where triangles cross or are turned over: the points there go to the middle of their neighbours, on the
/// input. Border points stay. @param places  near which; @param radius_mm  how near
void even_out(const FitTarget& target, const std::vector<Eigen::Vector3d>& places, double radius_mm,
              reconstruction::Surface& surface);

/// Moves the points of a coarse surface to the least squares distance from the input: point to plane, matched anew in
/// each round, with smoothing in the tangent plane only, so that the surface neither shrinks nor flattens. Border
/// points stay on the borders, corners where they are. Triangles do not turn over: steps that would are shortened.
/// @param coarse  its points are moved; sizes and normals (of the input) are used
/// @param nearest  by sample of the target the triangle nearest to it, as the last fit left it, where the next one
///   starts to search; empty at first
void fit_surface(const FitTarget& target, const QuadPairs& pairs, const FitOptions& options, FieldMesh& coarse,
                 std::vector<int>& nearest);

}  // namespace supine::meshing
