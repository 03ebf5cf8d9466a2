// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "common/arrays.h"

namespace supine::meshing {

struct FieldGraph;

/// Directions of largest curvature as wishes for an orientation field: tangent vectors, #P by 3, as long as the wish is
/// sure: 0 on a sphere or plane, up to 1 where the two principal curvatures differ much over one wanted edge length.
///
/// The shape operator is fitted to the normals of the neighbours, n_q − n_p = S (x_q − x_p) in the tangent plane, and
/// smoothed over a neighbourhood of about one wanted edge length, so that the noise of the input does not speak.
/// @param graph  points, normals, sizes and neighbours are used
Points curvature_wishes(const FieldGraph& graph);

/// Larger absolute principal curvature per point, 1/mm, smoothed in the same way.
Eigen::VectorXd largest_curvatures(const FieldGraph& graph);

}  // namespace supine::meshing
