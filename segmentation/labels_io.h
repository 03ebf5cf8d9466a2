// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "segmentation/image.h"

namespace supine::segmentation {

/// Writes labels.vti: points at the voxel centres with the uint8 point array `tissue`; field data `frame` = "LPS",
/// `unit` = "mm", `tissue_names` (index = value); VTK's direction matrix holds the direction. Same image, same bytes.
/// @throws InputError  when the file cannot be written
void write_labels(const LabelImage& labels, const std::filesystem::path& file);

/// Reads what write_labels wrote; frame RAS is converted.
/// @throws InputError  as read_image; also when there is no point array `tissue` or a value is not a Tissue
LabelImage read_labels(const std::filesystem::path& file);

}  // namespace supine::segmentation
