// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <ostream>

#include "simulation/export/exported_pose.h"

namespace supine::simulation {

/// FEBio 4 (file format 4.0): tet4, "neo-Hookean" (μ/2 (I1 - 3) - μ ln J + λ/2 ln²J, as ours), "linear constraint" and
/// discrete "linear spring" for the springs, nodal forces on a ramp. Logs the displacements to NAME_febio_u.csv.
void write_febio(std::ostream& out, const ExportedPose& pose);

}  // namespace supine::simulation
