// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/arrays.h"

namespace supine::simulation {

/// F of x over X at the nodes: the mean of the straight tetrahedra around each, weighted by their undeformed volume;
/// the identity where there is none.
/// @param cells  #C by 4 or 10, corners first
/// @param x, X   deformed and undeformed nodes, #N by 3, mm
/// @return  F_iJ = ∂x_i/∂X_J, one per node
std::vector<Eigen::Matrix3d> nodal_deformation(const Indices& cells, const Points& x, const Points& X);

/// A deformed shape for a body whose undeformed shape is a little different: x + F (X' - X), with F at the nodes. To
/// first order det F stays what it was, where moving x as X was moved would compress nearly incompressible cells until
/// their tangent is indefinite. A node with x = X is held there and moves as X does.
/// @param cells  #C by 4 or 10, corners first
/// @param x, X   deformed and undeformed nodes, #N by 3, mm
/// @param moved  X', #N by 3, mm
Points pushed_forward(const Indices& cells, const Points& x, const Points& X, const Points& moved);

}  // namespace supine::simulation
