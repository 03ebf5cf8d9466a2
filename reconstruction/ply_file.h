// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "common/arrays.h"
#include "reconstruction/surface_text.h"

namespace supine::reconstruction {

/// What a PLY file says of a surface.
struct PlySurface {
  Points points;                        ///< #V by 3; of float properties rounded to float
  std::vector<std::vector<int>> faces;  ///< vertices of each, 3 or more
  Declaration declaration;
};

/// Reads a PLY file, number by number and believing none of them: VTK's reader does not survive damaged ones.
/// @throws InputError  naming file, line or entry: no PLY, another format, an unknown type, no vertices, a vertex
///   without x, y and z, a face without a list of its corners, cut short, a word that is no number (a decimal comma), a
///   face of fewer than 3 corners or with a vertex that is not there
PlySurface read_ply(const std::filesystem::path& file);

}  // namespace supine::reconstruction
