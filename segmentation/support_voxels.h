// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "segmentation/image.h"

namespace supine::segmentation {

/// A support with a name: the label values of its voxels. As tissue they are muscle.
struct LabelSupport {
  std::string name;
  std::vector<int> values;
};

/// As many as one byte a voxel can number.
inline constexpr std::size_t most_supports = 255;

/// Contact with tissue on less than that is noise of the labels.
inline constexpr double smallest_contact_mm2 = 20;

/// Which voxels belong to which support.
struct SupportVoxels {
  std::vector<std::string> names;    ///< empty: whatever is muscle is the one support
  std::vector<std::uint8_t> number;  ///< per voxel (Grid::index order) 0 for none, n for names[n - 1]; or empty
};

/// @param values  the label map as read
/// @param supports  at most most_supports, no value in two of them
SupportVoxels mark_supports(const GreyImage& values, const std::vector<LabelSupport>& supports);

/// @param file  for messages
/// @throws InputError  a support without a voxel, or whose voxels border on tissue that is meshed with no face or with
///   faces of less than smallest_contact_mm2: its name, how many voxels it has, the first of them in mm
void check_supports(const SupportVoxels& supports, const LabelImage& labels, const std::string& file);

/// The support of the voxel whose centre is nearest to a point, of equally near ones the first.
/// @pre  there is a voxel of a support
/// @return row of SupportVoxels::names
int nearest_support(const SupportVoxels& supports, const Grid& grid, const Eigen::Vector3d& point_mm);

}  // namespace supine::segmentation
