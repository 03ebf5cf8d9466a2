// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/quads/quad_pairs.h"
#include "meshing/surface/triangle_tree.h"

namespace supine::meshing {

/// Turns the diagonal of a quad where the other one serves tetrahedra and shape better: larger smallest angle of its
/// two triangles, middle nearer to the input, no triangle turned over. Numbers of triangles and quads stay.
/// @param input  the surface the quads stand for
/// @return diagonals turned
int choose_diagonals(const TriangleTree& input, const QuadPairs& pairs, reconstruction::Surface& surface);

}  // namespace supine::meshing
