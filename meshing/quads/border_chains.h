// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// The chains of edges between regions and along open borders.
class BorderChains {
 public:
  /// Keeps @p surface by reference.
  explicit BorderChains(const reconstruction::Surface& surface);

  bool on_border(int p) const { return !along_[p].empty(); }
  /// Border neighbours of a point: two along a chain, more where chains meet.
  const std::vector<int>& neighbours(int p) const { return along_[p]; }

  /// The place @p length_mm along the chain from p, starting toward its neighbour @p next; nearer where the chain ends.
  Eigen::RowVector3d walk(int p, int next, double length_mm) const;

  /// Tangent of the chain at a point, over @p length_mm to both sides: steps of voxels do not speak. Unit, or zero.
  Eigen::RowVector3d tangent(int p, double length_mm) const;

  /// By point: 1 where other than two border edges meet, and where a chain turns by more than 66 degrees over
  /// @p size_mm to both sides, at its sharpest.
  std::vector<char> corners(const Eigen::VectorXd& size_mm) const;

 private:
  double turn_cosine(int p, double length_mm) const;
  bool sharpest(int p, double length_mm, const std::vector<double>& cosine) const;

  const reconstruction::Surface& surface_;
  std::vector<std::vector<int>> along_;
};

}  // namespace supine::meshing
