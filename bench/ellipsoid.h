// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/model.h"

namespace supine::bench {

/// Reads the half ellipsoid that SOFA and CalculiX were run on: legacy VTK, metres, base on z = 0. Faces on the base
/// are inner, the others skin.
/// @param order  2 adds straight mid-edge nodes
/// @throws InputError  not a VTK mesh, or one without tetrahedra
meshing::TetMesh read_ellipsoid(const std::string& file, int order = 1);

/// What the engine asks of an anatomy when the base is held: the outward direction.
meshing::Anatomy ellipsoid_anatomy(const meshing::TetMesh& mesh);

/// Base held, ν 0.45, 1000 kg/m³ of the undeformed volume, skin corotational, 1.5 mm.
simulation::Model ellipsoid_model(simulation::BulkLaw law, double young_kpa, double skin_kpa,
                                  simulation::Compression compression);

}  // namespace supine::bench
