// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace supine::segmentation {

/// What a voxel or a tetrahedron is made of. The numbers are those of labels.vti and of the cell array `tissue`.
enum class Tissue : std::uint8_t {
  air = 0,
  adipose = 1,
  gland = 2,
  skin = 3,
  muscle = 4,
  tumour = 5,
  nipple = 6,
  vessel = 7,
  ligament = 8,
  excluded = 9  ///< not meshed; tissue next to it ends in a cut face
};

inline constexpr int tissue_count = 10;

/// Names as case.toml and the field data of our files spell them; index = value of Tissue.
inline constexpr std::array<std::string_view, tissue_count> tissue_names = {
    "air", "adipose", "gland", "skin", "muscle", "tumour", "nipple", "vessel", "ligament", "excluded"};

/// @return nothing for a name that is not in tissue_names
std::optional<Tissue> tissue_from_name(std::string_view name);

/// Whether tetrahedra are made of it: everything but air, muscle (rigid) and excluded.
constexpr bool is_meshed(Tissue t) { return t != Tissue::air && t != Tissue::muscle && t != Tissue::excluded; }

}  // namespace supine::segmentation
