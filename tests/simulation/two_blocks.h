// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "tests/simulation/scene.h"

namespace supine::testing {

/// Two blocks over each other that share no node: the lower one on the muscle z = 0, the upper one a gap above it.
struct TwoBlocks {
  Eigen::Vector3d lower_mm{40, 40, 20}, upper_mm{40, 40, 20};
  int lower_cubes = 4, upper_cubes = 3;  ///< along each edge in the plane; half as many in height
  double gap_mm = 4;
  double tilt_rad = 0;  ///< of the upper one about x, through the middle of its lower face
  int order = 1;
};

/// Skin: the top of the lower block and the bottom of the upper one; the rest of the boundary is cut, the bottom inner.
/// Nodes of the upper block follow those of the lower one, `first_upper` is the first.
struct TwoBlocksScene : TestScene {
  Eigen::Index first_upper = 0;
};

TwoBlocksScene two_blocks_scene(const TwoBlocks& blocks);

}  // namespace supine::testing
