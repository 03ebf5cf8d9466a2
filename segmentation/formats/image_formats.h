// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "segmentation/formats/image_io.h"
#include "segmentation/image.h"

// Readers of one format each, for image_io.cpp alone.
namespace supine::segmentation::formats {

/// A volume in the coordinates of its file, unchecked but for what the reader needs to read it.
struct RawImage {
  Grid grid;                  ///< spacing and direction as `axes` gives them; see set_axes
  Eigen::Matrix3d axes;       ///< column a = step from voxel to voxel along axis a, in the file's coordinates
  std::vector<float> voxels;  ///< size.prod()
  std::optional<std::string> frame;
  std::vector<std::string> warnings;
};

RawImage read_nrrd(const std::filesystem::path& file);
RawImage read_meta_image(const std::filesystem::path& file);
RawImage read_nifti(const std::filesystem::path& file);
RawImage read_vti(const std::filesystem::path& file);

/// Turns what a reader found into LPS, checked as read_image says. @param file  for messages
ImageFile finish(const std::filesystem::path& file, RawImage raw, const std::string& case_frame);

/// The signs s such that diag(s) takes coordinates of @p frame to LPS; nothing for an unknown frame.
std::optional<Eigen::Vector3d> signs_to_lps(const std::string& frame);

/// The warning of a volume that does not say where it lies. @param key  that would say it
std::string no_origin(const std::filesystem::path& file, const std::string& key);

/// @throws InputError  when an axis has no voxel or there are more than 2^31 voxels in all
void check_size(const std::filesystem::path& file, const Eigen::Vector3i& size);

/// A header that promises more voxels than the file can hold is noticed before memory is asked for.
/// @param promised  bytes of voxels
/// @param there     bytes of the file, or of what may hold voxels in it
/// @param packed    whether they are deflated (gzip, zlib)
/// @throws InputError
void check_holdable(const std::filesystem::path& file, std::size_t promised, std::uintmax_t there, bool packed);

}  // namespace supine::segmentation::formats
