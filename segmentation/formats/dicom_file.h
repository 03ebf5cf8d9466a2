// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

namespace supine::segmentation::formats {

/// Whether a file begins as DICOM files do: 128 bytes, then DICM.
bool is_dicom(const std::filesystem::path& file);

/// Whether a DICOM file ends before its pixels do, which the library does not mind.
bool is_cut_short(const std::filesystem::path& file);

}  // namespace supine::segmentation::formats
