// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

namespace supine::segmentation {

/// The file that holds the voxels when the header is a file of its own (`data file:` of a .nhdr, `ElementDataFile` of a
/// .mhd), so that its change can be noticed; nothing when the voxels are in @p header itself, or in a list of files.
std::optional<std::filesystem::path> detached_data_file(const std::filesystem::path& header);

}  // namespace supine::segmentation
