// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "phantom/body_mesh.h"

namespace supine::phantom {

/// A place in the mound, followed from prone to supine as a cyst or a lymph node would be.
struct InnerPlace {
  double moved_mm;
  double from_nipple_mm;  ///< the same relative to the nipple
  double muscle_mm[2];    ///< distance to the muscle, prone and supine
  double skin_mm[2];      ///< distance to the skin, prone and supine
};

/// How far a body moves from prone to supine; the muscle stays.
struct Motion {
  Eigen::Vector3d nipple_mm;  ///< toward the outer side, back, head
  std::vector<InnerPlace> inside;
  Points prone, supine;  ///< #inside + 1 by 3, LPS mm: those places, then the middle of the tumour
};

/// @param prone, supine  nodes, LPS mm
/// @param seed           of the places: 20, even over the volume above the foot of the stress-free body
Motion measure_motion(const BodyMesh& body_mesh, const Body& body, const Points& prone, const Points& supine,
                      std::uint64_t seed);

}  // namespace supine::phantom
