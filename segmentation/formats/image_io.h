// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "segmentation/image.h"

namespace supine::segmentation {

/// A volume as read from a file, in LPS mm.
struct ImageFile {
  GreyImage image;
  std::string frame;                  ///< the frame the file names ("LPS", "RAS", "LAS"); empty when it names none
  std::vector<std::string> warnings;  ///< what was assumed in reading it
};

/// Reads a scalar volume: .nrrd .nhdr (.seg.nrrd), .mha .mhd, .nii .nii.gz, .vti. Voxels keep the file's order;
/// spacing, origin and direction (flipped, oblique) go into the grid.
///
/// Frame. NRRD: `space`. MetaImage: `AnatomicalOrientation` as far as it settles it. NIfTI: RAS by definition; the
/// sform holds when sform_code > 0, else the qform when qform_code > 0, else neither is used and the file names no
/// frame. VTI: the field data string `frame`. Coordinates in RAS or LAS are converted to LPS.
/// @param case_frame  LPS or RAS, the frame of a file that names none; empty: such a file is refused
/// @throws InputError  naming file, key and value: unknown format, unreadable or truncated file, not three axes,
/// colour,
///   spacing <= 0, direction not orthonormal (1e-3), a unit that is not mm, a volume less than 3 mm wide (metres),
///   a voxel that is not finite, all voxels equal, frame unknown, missing or in contradiction with the axes
ImageFile read_image(const std::filesystem::path& file, const std::string& case_frame);

}  // namespace supine::segmentation
