// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// The surface a coarse one stands for, asked region by region. Ligament counts as inner.
///
/// Points are smoothed: the value of a quadratic fitted to the fine points around, so that a node does not follow the
/// noise that voxels leave, which a curved face would turn into curvature.
class FineSurface {
 public:
  /// @param surface  closed, with regions
  /// @throws InputError  no regions, or fewer than 4 triangles
  explicit FineSurface(const reconstruction::Surface& surface);
  ~FineSurface();
  FineSurface(const FineSurface&) = delete;
  FineSurface& operator=(const FineSurface&) = delete;

  /// Closest point of one region's triangles, moved along the normal onto the quadratic that fits that region's points
  /// within @p smooth_mm (0 = not moved). Empty where the surface has no such region.
  std::optional<Eigen::Vector3d> on_region(const Eigen::Vector3d& point_mm, int region, double smooth_mm) const;

  /// Closest point of the curve between two regions: of a parabola fitted to the border's points within @p smooth_mm.
  /// Empty where the two do not meet.
  std::optional<Eigen::Vector3d> on_border(const Eigen::Vector3d& point_mm, int region, int other,
                                           double smooth_mm) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// inner for ligament, else the region itself.
int patch_of(int region);

}  // namespace supine::meshing
