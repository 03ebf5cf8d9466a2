// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reconstruction/surface.h"

namespace supine::meshing {

/// A place in or on a body that came as a surface: a plane, or a surface of its own. mm, LPS.
struct BodyPlace {
  std::string name;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit; out of the body at a support, into the part at a part
  std::optional<reconstruction::Surface> surface;    ///< instead of the plane
  double within_mm = 0.5;                            ///< supports: how far a face that lies on it may be off, > 0
  bool beyond = false;  ///< supports: every face on the plane's outer side, not those that lie in it alone
};

/// The support that a face lies on: within its within_mm and, of a plane, facing as its normal does to 30 degrees.
/// @param centre, normal  of the face; unit, out of the body
/// @return row of @p supports; −1 where it lies on none
/// @throws InputError  it lies on two of them: names both and the place
int support_of_face(const std::vector<BodyPlace>& supports, const Eigen::Vector3d& centre,
                    const Eigen::Vector3d& normal);

/// The closed surface of a body with regions: inner where it lies on a support, else skin.
/// @param what  names the surface in messages
/// @throws InputError  no support; one on which no face lies: its name, the nearest face's place and distance
reconstruction::Surface with_support_regions(reconstruction::Surface body, const std::vector<BodyPlace>& supports,
                                             const std::string& what);

/// Whether a point lies in a part: on the inner side of its plane, or within its closed surface (winding number).
bool lies_in_part(const BodyPlace& part, const Eigen::Vector3d& at);

}  // namespace supine::meshing
