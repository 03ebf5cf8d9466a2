// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "meshing/tet_mesh.h"

namespace supine::simulation {

/// How much of its stiffness skin or cut has at the quadrature points of some faces: nothing where the skin ends, all
/// of it @p length_mm away, t²(3 − 2t) between. A membrane that ends at full tension pulls at a line of the body, whose
/// displacement has no limit as the mesh gets finer (Kelvin's solution of a line load, logarithmic); one that fades
/// hands its tension over an area.
/// @tparam Face      Tri3Centroid, Tri3 or Tri6
/// @param faces      rows of mesh.faces
/// @param length_mm  straight through space, in the imaged shape; >= 0
/// @return faces × Face::points, those of one face follow each other; empty for length 0: all of it everywhere
/// @throws InputError  length > 0 and the skin borders on nothing
template <class Face>
Eigen::VectorXd fade_from_skin_end(const meshing::TetMesh& mesh, const Eigen::VectorXi& faces, double length_mm);

}  // namespace supine::simulation
