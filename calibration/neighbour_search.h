// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "common/arrays.h"

namespace supine::calibration {

/// The nearest of a fixed set of points. Threads may ask at the same time.
class NeighbourSearch {
 public:
  explicit NeighbourSearch(const Points& points);
  ~NeighbourSearch();
  NeighbourSearch(NeighbourSearch&&) noexcept;
  NeighbourSearch& operator=(NeighbourSearch&&) noexcept;

  /// Squared distance and row of the nearest points, nearest first; of equally near ones the lower row first.
  std::vector<std::pair<double, int>> nearest(const Eigen::Vector3d& query, int count) const;

  const Points& points() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace supine::calibration
