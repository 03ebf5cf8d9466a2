// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "segmentation/image.h"

namespace supine::segmentation::testing {

/// What the slices of a written series say beside their voxels.
struct SeriesHeader {
  std::string uid = "1.2.3.4", number = "7", description = "t1 tse", position = "FFP", laterality;
  std::string frame_of_reference = "1.2.3.9";
  int samples = 1, frames = 1;
};

/// Writes slice k of an image (values 0 to 65535) as one DICOM file, explicit little endian.
/// @param shift_mm  moves the slice from its place
void write_dicom_slice(const std::filesystem::path& file, const GreyImage& image, int k,
                       const SeriesHeader& header = {}, const Eigen::Vector3d& shift_mm = Eigen::Vector3d::Zero());

/// All slices, named so that the order of names is not that of places.
void write_dicom_series(const std::filesystem::path& folder, const GreyImage& image, const SeriesHeader& header = {});

}  // namespace supine::segmentation::testing
