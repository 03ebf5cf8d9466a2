// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// read_mesh() for a mesh that a model is to be made of: a body of one piece in its imaged shape.
/// @param side  of the case: left, right or both; none of an object, which may be of any size
/// @throws InputError  as read_mesh(); the shape of another pose; another side than the case's; a volume outside 10 to
///   10000 ml; a piece that touches neither muscle nor cut, with its volume and place
TetMesh read_imaged_mesh(const std::filesystem::path& file, const std::string& side);

}  // namespace supine::meshing
