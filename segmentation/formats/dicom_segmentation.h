// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "segmentation/formats/image_formats.h"

namespace supine::segmentation::formats {

/// Reads a DICOM segmentation (SEG; DICOM PS3.3 A.51) as a label map: every voxel has the number of the segment that
/// covers it, 0 where none does. Frames that are not stored are empty. Binary, fractional (half and more counts) and
/// label map; not compressed. Where segments overlap the higher number holds, with a warning.
/// @throws InputError  another kind of DICOM file; cut short; compressed; frames of different orientation or place
///   across, or not evenly spaced; what says where they lie is missing
RawImage read_dicom_segmentation(const std::filesystem::path& file);

}  // namespace supine::segmentation::formats
