// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>

#include "segmentation/formats/samples.h"
#include "segmentation/image.h"

namespace supine::segmentation::formats {

/// Writes NIfTI-1 in one file, gzipped when its name ends in .gz.
/// @param bytes       samples in this machine's order, one component after the other
/// @param components  1, or 3: vectors on the fifth axis with intent 1007
/// @return  whether all of it was written
bool write_nifti(const Grid& grid, std::span<const std::byte> bytes, SampleType type, int components,
                 const std::filesystem::path& file);

}  // namespace supine::segmentation::formats
