// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/patient_frame.h"

#include <string_view>

namespace supine::pipeline {

std::optional<Eigen::Matrix3d> axes_of_frame(const std::string& frame) {
  constexpr std::string_view forth = "LPS", back = "RAI";
  if (frame.size() != 3) return std::nullopt;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (int column = 0; column < 3; ++column) {
    const char letter = frame[static_cast<std::size_t>(column)];
    for (int row = 0; row < 3; ++row) {
      const auto at = static_cast<std::size_t>(row);
      axes(row, column) = letter == forth[at] ? 1 : letter == back[at] ? -1 : 0;
    }
  }
  // A permutation with signs: every letter known, no direction twice.
  if (axes.transpose() * axes != Eigen::Matrix3d::Identity()) return std::nullopt;
  return axes;
}

segmentation::Grid in_lps(segmentation::Grid grid, const Eigen::Matrix3d& axes) {
  grid.origin_mm = axes * grid.origin_mm;
  grid.direction = axes * grid.direction;
  return grid;
}

}  // namespace supine::pipeline
