// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/tetrahedra/size_field.h"
#include "reconstruction/surface.h"

namespace supine::meshing {

/// Remeshes a surface so that its edges are shorter where skin and cut face meet: there the skin's tension passes into
/// the tissue and its hold within a few mm, and this sets how far the breast slides as a whole. Edges grow step by
/// step, doubling over about four of their lengths, to the mean edge of @p surface elsewhere.
/// @param surface  closed manifold with regions
/// @param edge_mm  edge length on that border, > 0; the nearest of mean edge / 2, / 4 and / 8 is taken
/// @return the same surface, regions and topology; @p surface itself where edge_mm is not below 0.71 of its mean edge,
/// or
///   where there is no such border
/// @throws InputError  edge_mm <= 0
reconstruction::Surface refine_skin_edge(const reconstruction::Surface& surface, double edge_mm);

/// Mean length of the edges between skin and cut face, mm; 0 where the two do not meet.
double skin_edge_mm(const reconstruction::Surface& surface);

/// Remeshes a surface so that its edges are as short as the size field asks for, down to an eighth of the mean edge;
/// nowhere longer than they are. @return the same surface, regions and topology
reconstruction::Surface refine_to_sizes(const reconstruction::Surface& surface, const SizeField& sizes);

}  // namespace supine::meshing
