// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "meshing/quads/field_graph.h"

namespace supine::meshing {

/// Unit tangents at the points of each level, level 0 first; each stands for its four turns by 90 degrees about the
/// normal.
using CrossField = std::vector<Points>;

/// Smooth 4-rotational-symmetric orientations (Jakob, Tarini, Panozzo, Sorkine-Hornung 2015, section 4.1, extrinsic),
/// along region borders and, where that is sure, along the directions of principal curvature. Gauss–Seidel sweeps from
/// the coarsest level to the finest, colour by colour: the result does not depend on the number of threads.
CrossField cross_field(const std::vector<FieldGraph>& levels, int sweeps = 6);

/// The turns of two crosses that agree best: a of {q_a, n_a × q_a}, b of {± q_b, ± n_b × q_b}.
std::pair<Eigen::Vector3d, Eigen::Vector3d> matching_turns(const Eigen::Vector3d& q_a, const Eigen::Vector3d& n_a,
                                                           const Eigen::Vector3d& q_b, const Eigen::Vector3d& n_b);

}  // namespace supine::meshing
