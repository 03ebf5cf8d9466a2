// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/quads/cross_field.h"

namespace supine::meshing {

/// Position field: for each point of the finest level the nearest node of its local lattice, which lies in the tangent
/// plane along the cross with the wanted edge length as spacing. Neighbours' lattices are made to agree (Jakob et al.
/// 2015, section 4.2, extrinsic), nodes on region borders stay on them, corners are nodes.
/// Colour by colour as the cross field: the result does not depend on the number of threads.
/// @return nodes, mm, one per point of level 0
Points position_field(const std::vector<FieldGraph>& levels, const CrossField& crosses, int sweeps = 12);

/// The sizes of all levels times a factor.
void scale_sizes(std::vector<FieldGraph>& levels, double factor);

}  // namespace supine::meshing
