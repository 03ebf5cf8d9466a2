// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "common/arrays.h"
#include "reconstruction/surface_text.h"

namespace supine::reconstruction {

/// What a file of polygons says of a surface.
struct Polygons {
  Points points;                        ///< #V by 3
  std::vector<std::vector<int>> faces;  ///< vertices of each, 3 or more
  Declaration declaration;
};

}  // namespace supine::reconstruction
