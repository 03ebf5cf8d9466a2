// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "phantom/body_mesh.h"
#include "phantom/phantom.h"
#include "phantom/truth.h"

namespace supine::phantom {

/// Lets a body with the phantom's causes and nuisances hang and lie in its poses, and draws the discrepancy there where
/// all comes from the priors. Body, poses and discrepancy of the phantom are replaced together, or left where a pose
/// has no equilibrium.
/// @param start  from no load, or from the shapes that the poses have
/// @throws NumericalFailure  no equilibrium
void solve_poses(const BodyMesh& body_mesh, const Body& body, const PhantomOptions& options, Phantom& phantom,
                 Truth::Start start = Truth::Start::no_load);

}  // namespace supine::phantom
