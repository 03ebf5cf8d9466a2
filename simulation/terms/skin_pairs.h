// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "simulation/terms/skin_samples.h"

namespace supine::simulation {

/// Which samples of the skin may touch which: all but those of neighbouring faces and of pairs left out.
class SkinPairs {
 public:
  /// A sample and those opposite that reach it, in ascending order.
  struct Group {
    int sample;
    std::vector<int> opposite;
  };

  /// @param samples  must outlive the object   @param imaged  nodes, #N by 3, mm: what neighbours are is told from them
  SkinPairs(const SkinSamples& samples, const Points& imaged);

  /// The samples of @p now that others reach which may touch them and look their way, in ascending order.
  void find(const SkinShape& now, std::vector<Group>& groups) const;

  /// Whether two faces are never a pair.
  bool apart(int face, int other) const;
  /// Takes pairs of faces for neighbours, either way round.
  void leave_out(const std::vector<std::pair<int, int>>& faces);

 private:
  const SkinSamples& samples_;
  double cell_mm_;                       // edge of the search grid: the largest reach
  std::vector<std::vector<int>> apart_;  // per face, sorted
};

}  // namespace supine::simulation
