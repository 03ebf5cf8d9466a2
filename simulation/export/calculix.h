// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <ostream>

#include "simulation/export/exported_pose.h"

namespace supine::simulation {

/// CalculiX 2.20 (Dhondt, CalculiX CrunchiX user's manual): C3D4, *HYPERELASTIC, NEO HOOKE; *EQUATION and SPRING1 for
/// the springs; one static step. Numbers have at most 20 characters: it reads no more. Prints the displacements of the
/// breast's nodes, from the undeformed shape, to .dat.
void write_calculix(std::ostream& out, const ExportedPose& pose);

}  // namespace supine::simulation
