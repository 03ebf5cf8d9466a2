// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/tetrahedra/ligament_ring.h"

#include <cmath>

namespace supine::meshing {

Eigen::Index mark_ligament_ring(TetMesh& mesh, const Anatomy& anatomy, double half_width_mm) {
  constexpr int inner = static_cast<int>(reconstruction::Region::inner);
  constexpr int ligament = static_cast<int>(reconstruction::Region::ligament);
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (mesh.region[f] != inner && mesh.region[f] != ligament) continue;
    const Eigen::Vector2d q =
        (anatomy.q.row(mesh.faces(f, 0)) + anatomy.q.row(mesh.faces(f, 1)) + anatomy.q.row(mesh.faces(f, 2)))
            .transpose() /
        3;
    const bool in_ring =
        std::abs(anatomy.breast_frame(anatomy.breast_of(mesh.faces(f, 0))).from_foot_mm(q)) <= half_width_mm;
    mesh.region[f] = in_ring ? ligament : inner;
    if (in_ring) ++count;
  }
  return count;
}

}  // namespace supine::meshing
