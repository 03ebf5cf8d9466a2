// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <string_view>

#include "common/arrays.h"

namespace supine::reconstruction {

/// What a boundary triangle borders on. The numbers are those of the cell array `region`.
enum class Region : int {
  none = 0,      ///< tetrahedra, and surfaces that carry no regions
  inner = 1,     ///< lies on the muscle
  skin = 2,      ///< borders on air
  ligament = 3,  ///< the part of the inner surface at the default place of the ligament ring
  cut = 4        ///< the model ends here, the body goes on
};

inline constexpr std::array<std::string_view, 5> region_names = {"none", "inner", "skin", "ligament", "cut"};

/// A triangle surface in mm, LPS. Closed ones are oriented outward.
struct Surface {
  Points points;           ///< #P by 3
  Triangles triangles;     ///< #T by 3
  Eigen::VectorXi region;  ///< #T values of Region, or empty
};

}  // namespace supine::reconstruction
