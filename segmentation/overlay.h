// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "segmentation/image.h"

namespace supine::segmentation {

/// Rows of RGB bytes, top row first.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< 3 width height
};

struct OverlayOptions {
  double pixel_mm = 0;  ///< side of a pixel; 0 = half the finest voxel side, at least 0.25
  int slices = 12;      ///< per picture, evenly spread over the voxels that are neither air nor excluded; 1 to 64
  int columns = 4;      ///< of the mosaic; >= 1
};

/// A mosaic of slices across one patient axis, with the outline of every tissue over the grey values.
///
/// The image axis nearest to the patient axis is the one that is cut, so voxels are not interpolated across slices.
/// Seen as radiologists do: axial from the feet with the patient's front up, sagittal from her left with the front
/// left, coronal from the front; the patient's right is on the left. The outline of a tissue is its outermost row of
/// pixels.
/// @param axis  0 sagittal (x), 1 coronal (y), 2 axial (z)
/// @param grey  the volume the labels were made of, or nothing: then the tissues are filled
/// @param places_mm  receives the patient coordinate of each slice's middle, in the order of the mosaic
Picture overlay(const LabelImage& labels, const GreyImage* grey, int axis, const OverlayOptions& options,
                std::vector<double>& places_mm);

/// Writes a PNG. @throws InputError  when the file cannot be written
void write_png(const Picture& picture, const std::filesystem::path& file);

/// The colour of a tissue's outline.
std::array<std::uint8_t, 3> tissue_colour(int tissue);

}  // namespace supine::segmentation
