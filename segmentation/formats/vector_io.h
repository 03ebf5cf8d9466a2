// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "segmentation/image.h"

namespace supine::segmentation {

/// A vector per voxel, mm, LPS components.
struct VectorImage {
  Grid grid;
  std::vector<Eigen::Vector3f> vectors;  ///< size grid.count(), Grid::index order
};

/// Writes a volume by its extension: .nrrd (gzip), .nii or .nii.gz. Whole numbers are stored as the smallest of uint8,
/// int16, uint16 and int32 that holds them, others as float. The NRRD is in LPS and says so; the NIfTI has sform and
/// qform in RAS, as it must.
/// @throws InputError  another extension; the file cannot be written
void write_image(const GreyImage& image, const std::filesystem::path& file);

/// Writes a field of vectors: .nrrd (`kinds: vector domain domain domain`, LPS, gzip) or .nii.gz (five axes, intent
/// 1007). In both the components are LPS: a NIfTI's place is in RAS, its vectors are taken as they are by ITK.
/// @throws InputError  as write_image
void write_vectors(const VectorImage& image, const std::filesystem::path& file);

}  // namespace supine::segmentation
