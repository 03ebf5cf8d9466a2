// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "segmentation/image.h"
#include "segmentation/masks.h"
#include "segmentation/tissue.h"

namespace supine::segmentation {

struct MappedLabels {
  LabelImage image;
  std::vector<std::string> warnings;  ///< one per value of the table that does not occur
};

/// Maps another program's label values to tissues.
/// @param table  value in the file -> tissue
/// @param name  of the file, for messages
/// @throws InputError  for a value that is not in the table: value, count, first place in mm
MappedLabels map_labels(const GreyImage& values, const std::map<int, Tissue>& table, const std::string& name);

/// The voxels of all tissues that tetrahedra are made of.
Mask meshed_mask(const LabelImage& labels);

/// Voxels per tissue, index = Tissue.
using TissueCounts = std::array<std::size_t, tissue_count>;
TissueCounts count_tissues(const LabelImage& labels);

/// What every case needs: some muscle, and some adipose or gland.
/// @throws InputError  naming the tissue that is empty
void check_tissues(const LabelImage& labels, const std::string& name);

/// Whether tissue reaches the edge of the image, where it would end in a cut face. Air, muscle and excluded may.
/// @throws InputError  with, per face of the image, the number of voxels and the first of them in mm
void check_edge(const LabelImage& labels, const std::string& name);

/// Whether tissue borders on excluded, where it would end in a cut face.
/// @throws InputError  with the number of voxels and the first of them in mm
void check_excluded(const LabelImage& labels, const std::string& name);

/// Components through voxel faces: per tissue, and of everything that is meshed taken together.
struct ComponentCounts {
  TissueCounts tissue{};
  std::size_t meshed = 0;
};
ComponentCounts count_components(const LabelImage& labels);

/// Dice overlap 2 |A and B| / (|A| + |B|) per tissue; NaN for a tissue neither has.
/// `breast` is that of adipose, gland and skin taken together.
struct Dice {
  std::array<double, tissue_count> tissue;
  double breast = 0;
};
/// @throws InputError  when the grids differ (size; spacing, origin or direction by more than 1e-3 mm at a corner)
Dice dice(const LabelImage& labels, const LabelImage& truth);

}  // namespace supine::segmentation
