// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "reconstruction/polygons.h"

namespace supine::reconstruction {

/// Reads vertices and faces of an OBJ file (v, f; "7", "7/1/3" or "-2"). Normals, textures, lines, points, groups and
/// materials are passed over.
/// @throws InputError  naming file and line: no vertices, a vertex that is not three finite numbers (a decimal comma),
/// a
///   face of fewer than 3 corners or with a vertex that is not there
Polygons read_obj(const std::filesystem::path& file);

}  // namespace supine::reconstruction
