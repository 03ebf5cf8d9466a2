// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// Whether the sheet of the muscle or support is that of this body: its inner region lies on it, and the sheet faces
/// the body. A tenth of the region may lie elsewhere: a decimated edge, a support that is left out.
/// @param body   closed, with regions; one without an inner region is not judged
/// @param sheet  open, normals toward the body
/// @param name   of the sheet's file, for the message
/// @throws InputError  more of it lies further from the sheet than half an edge of the body (3 mm at least), or over
///   triangles of the sheet that face away
void check_sheet(const reconstruction::Surface& body, const reconstruction::Surface& sheet, const std::string& name);

}  // namespace supine::meshing
