// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "meshing/tet_mesh.h"

namespace supine::testing {

/// Two mounds of one piece over one flat muscle: x to the patient's left, y posterior, z head; outward is -y, muscle y
/// = 0. The left one stands around x = 75 mm, the right one around x = -75 mm, both round with a foot of 55 mm.
struct TwoBreasts {
  double left_height_mm = 44;  ///< above the rim's thickness
  double right_height_mm = 44;
  double rim_thickness_mm = 12;
  int across = 28, up = 14, deep = 3;  ///< cubes along x, z and through the thickness, six tetrahedra each
  bool apart = false;                  ///< two pieces, with a gap of 20 mm between them
};

/// All adipose; front skin, back inner, sides cut.
meshing::TetMesh two_breasts_mesh(const TwoBreasts& options = {});

}  // namespace supine::testing
