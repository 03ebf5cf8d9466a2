// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <ostream>

#include "simulation/export/exported_pose.h"

namespace supine::simulation {

/// A SOFA scene (XML, components of v24.12 and later): StaticSolver with NewtonRaphsonSolver at full load,
/// TetrahedronFEMForceField (svd for corotational, large for corotational_qr) or
/// TetrahedronHyperelasticityFEMForceField (NeoHookean, as ours), SpringForceField between mapped points and far
/// anchors for the springs.
void write_sofa(std::ostream& out, const ExportedPose& pose);

}  // namespace supine::simulation
