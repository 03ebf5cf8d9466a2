// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "phantom/body.h"

namespace supine::phantom {

struct BodyMesh {
  meshing::TetMesh mesh;     ///< stress-free, LPS mm; fractions of adipose, gland and tumour
  meshing::Anatomy anatomy;  ///< from the formulas: q = (u, v) / foot radius, muscle = the formula's height field
};

/// Fills the body with tetrahedra: rings of triangles on the disc, put onto skin and muscle by the formulas, a wall at
/// the rim, TetGen inside. Quadratic edges of the boundary are bent onto the formulas.
/// @param rings  from centre to rim, >= 4; edges are about reach × foot radius / rings long
/// @param order  1 or 2
BodyMesh mesh_body(const Body& body, std::uint64_t seed, int rings, int order);

}  // namespace supine::phantom
