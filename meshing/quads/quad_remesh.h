// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "meshing/quads/quad_pairs.h"
#include "meshing/surface/triangle_tree.h"

namespace supine::meshing {

/// A quad-dominant surface as triangles.
struct QuadMesh {
  reconstruction::Surface surface;  ///< with the regions of the input, if it has any
  QuadPairs pairs;                  ///< which triangles form quads
  Eigen::VectorXd size_mm;          ///< edge length that was wanted, by point
};

/// How many faces: the first of the three that is not 0.
struct QuadTarget {
  int triangles = 0;   ///< at most so many, and little less
  int faces = 0;       ///< quads and lone triangles together, within a few per cent
  double edge_mm = 0;  ///< where the size field is 1
};

/// Field-aligned quad-dominant remeshing after Jakob, Tarini, Panozzo and Sorkine-Hornung, "Instant Field-Aligned
/// Meshes" (2015): orientation field, position field, extraction; then a least squares fit to the input.
///
/// The extraction collapses triangles onto the nodes of the position field and refuses every collapse that would change
/// topology, region borders or open borders; so the Euler characteristic is the input's by construction. What is not
/// guaranteed is geometry: parts thinner than the edges can intersect. Look with self_intersections().
/// The same bytes for any number of threads.
class QuadRemesher {
 public:
  /// @param in        manifold, oriented; closed or open; with regions or without; kept by reference
  /// @param relative  wanted edge length by point of @p in, as a factor, > 0; empty = 1 everywhere
  /// @param edge_mm   rough guess of the edge length: fields get a resolution that fits it
  /// @param tree      of @p in, where there is one already
  QuadRemesher(const reconstruction::Surface& in, const Eigen::VectorXd& relative, double edge_mm,
               std::shared_ptr<const TriangleTree> tree = nullptr);
  QuadRemesher(const QuadRemesher&) = delete;
  QuadRemesher& operator=(const QuadRemesher&) = delete;
  ~QuadRemesher();

  /// Asks for other sizes near places: at most @p factor times those now within @p radius_mm, growing gently away.
  void refine(const Points& places, double factor, double radius_mm);

  QuadMesh make(const QuadTarget& target);

  /// Evens out near places where triangles cross or are turned over. @pre  make() was called
  void even_out(const std::vector<Eigen::Vector3d>& places, QuadMesh& mesh) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Edge length that gives about so many triangles: squares cut in two, denser where @p relative is small.
double edge_for_triangles(const reconstruction::Surface& in, const Eigen::VectorXd& relative, int triangles);

}  // namespace supine::meshing
