// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>

#include "reconstruction/surface.h"

namespace supine::reconstruction {

/// Finds closest points on a surface (AABB tree). Holds a copy of the surface.
class SurfaceTree {
 public:
  /// @pre  at least one triangle
  explicit SurfaceTree(const Surface& surface);
  SurfaceTree(const SurfaceTree&) = delete;
  SurfaceTree& operator=(const SurfaceTree&) = delete;
  ~SurfaceTree();

  /// Distance of each point to the surface, unsigned, mm. @param points  #Q by 3
  Eigen::VectorXd distances_mm(const Points& points) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace supine::reconstruction
