// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "meshing/anatomy.h"

namespace supine::meshing {

/// The frame of a body that is no breast (see Anatomy).
/// @throws InputError  no inner faces (nothing holds the body) or no skin faces; a support of too few triangles
Anatomy object_frame(const TetMesh& mesh, const std::string& imaged_pose);

}  // namespace supine::meshing
