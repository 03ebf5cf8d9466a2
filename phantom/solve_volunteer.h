// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "phantom/body_mesh.h"
#include "phantom/phantom.h"

namespace supine::phantom {

/// Lets a breast hang and lie with its moduli scaled together until its nipple moves Body::nipple_moves_mm, to 3 %, in
/// the ranges of volunteers.h. Where the drawn moduli are not carried from no load they are raised by half up to four
/// times; from there shapes are followed. Where the way ends before the nipple has moved as far, the last shapes stay;
/// Phantom::gave_way says why.
/// @throws NumericalFailure  no equilibrium even with the stiffest
void solve_volunteer(const BodyMesh& body_mesh, const PhantomOptions& options, Phantom& phantom);

}  // namespace supine::phantom
