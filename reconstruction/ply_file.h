// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "reconstruction/polygons.h"

namespace supine::reconstruction {

/// Reads a PLY file (float properties rounded to float), number by number and believing none of them: VTK's reader does
/// not survive damaged ones.
/// @throws InputError  naming file, line or entry: no PLY, another format, an unknown type, no vertices, a vertex
///   without x, y and z, a face without a list of its corners, cut short, a word that is no number (a decimal comma), a
///   face of fewer than 3 corners or with a vertex that is not there
Polygons read_ply(const std::filesystem::path& file);

}  // namespace supine::reconstruction
