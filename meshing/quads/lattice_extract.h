// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/quads/field_mesh.h"

namespace supine::meshing {

/// Collapses the field mesh onto the nodes of its position field: points of one node become one point, so that edges of
/// the lattice and one diagonal per cell are left. Only collapses and flips that keep topology, regions and borders are
/// made, so these hold by construction; triangles of odd shape are left where fields are singular, few after mending.
/// @param fields  field mesh; @param cross  unit tangents; @param nodes  from position_field; all by point
/// @return triangles with their regions, unit normals and wanted sizes by point
FieldMesh extract_lattice(const FieldMesh& fields, const Points& cross, const Points& nodes);

}  // namespace supine::meshing
