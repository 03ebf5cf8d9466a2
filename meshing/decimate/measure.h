// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "meshing/decimate/decimate.h"
#include "meshing/surface/sound_surface.h"

namespace supine::meshing {

/// Measures decimated surfaces against their input: one place for all methods and for the figures that are reported.
class DecimateMeasure {
 public:
  /// Keeps @p in by reference. @param sound  what require_sound() found of it
  DecimateMeasure(const reconstruction::Surface& in, SoundSurface sound);
  explicit DecimateMeasure(const reconstruction::Surface& in);

  const reconstruction::Surface& input() const { return in_; }
  const reconstruction::SurfaceReport& report() const { return report_; }
  std::shared_ptr<const TriangleTree> tree() const { return tree_; }

  /// Components, Euler characteristic and number of open borders' edges (none or some) are the input's; manifold.
  bool same_topology(const reconstruction::Surface& out) const;

  /// Fills in the distances of result.surface.
  /// @return places nearer to the bound than 0.9 of it or beyond, where the bound is broken anywhere; else none
  std::vector<Eigen::Vector3d> places_too_far(double bound_mm, DecimateResult& result) const;

  /// Triangles that face away from the input next to them, and triangles that intersect others: their corners.
  std::vector<Eigen::Vector3d> unsound_places(const reconstruction::Surface& out) const;

  /// Moves all points along their normals until the volume is the input's. Closed surfaces only; others stay.
  void give_volume_back(reconstruction::Surface& out) const;

  /// Edge length, angles, volume change, quads' angles.
  void measure_shape(DecimateResult& result) const;

 private:
  const reconstruction::Surface& in_;
  reconstruction::SurfaceReport report_;
  std::shared_ptr<const TriangleTree> tree_;
  Points samples_;                        // of the input
  std::unique_ptr<TriangleTree> border_;  // of the input's borders; none without
};

/// Points of a surface and of a regular lattice in each of its triangles, no two neighbours further apart than given.
Points dense_samples(const reconstruction::Surface& surface, double spacing_mm);

/// One place of each cell of a grid, the first.
std::vector<Eigen::Vector3d> thinned(const std::vector<Eigen::Vector3d>& places, double cell_mm);

}  // namespace supine::meshing
