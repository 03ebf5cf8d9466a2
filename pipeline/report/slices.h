// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>

#include "pipeline/case/case.h"
#include "pipeline/tool/tool.h"
#include "segmentation/image.h"

namespace supine::pipeline {

/// Voxels that a page holds at most: as base64 7.5 MB, so that a page grows by less than 8.
inline constexpr double most_slice_voxels = 5.6e6;

/// A volume as grey bytes on an upright grid (axes x, y, z of the patient, LPS), cut out and thinned for showing:
/// linear between the voxels, white and black at the quantiles 0.5 % and 99.5 % of what is cut out.
struct GreyBytes {
  segmentation::Grid grid;
  double black = 0, white = 1;  ///< values of the bytes 0 and 255
  std::vector<std::uint8_t> voxels;
};

/// @param low, high  corners of what is wanted, mm; only what the volume holds of it is kept
/// @param most       voxels
GreyBytes grey_bytes(const segmentation::GreyImage& volume, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                     double most);

/// The volume that supine-warp carried into the predicted pose (OUT/warp, the grey one before labels), around the body
/// there: {pose, file, size, spacing_mm, origin_mm, black, white, voxels (base64)}. Null when there is none.
/// @throws InputError  a file that cannot be read
nlohmann::ordered_json slices_json(Run& run, const Case& measured, const std::filesystem::path& out);

}  // namespace supine::pipeline
