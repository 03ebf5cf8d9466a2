// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/further_poses.h"

#include <cmath>
#include <numbers>

namespace supine::diagnosis {

std::vector<FurtherPose> further_poses(const Eigen::Vector3d& down, const Eigen::Vector3d& lateral) {
  const Eigen::Vector3d feet(0, 0, -1);
  const auto tilted = [&down](double degrees, const Eigen::Vector3d& to) -> Eigen::Vector3d {
    const double a = degrees * std::numbers::pi / 180;
    return (std::cos(a) * down + std::sin(a) * to).normalized();
  };
  const std::string side = lateral.x() > 0 ? "left" : "right";
  return {{"tilted 45 degrees, head up", tilted(45, feet)},
          {"tilted 45 degrees to the patient's " + side, tilted(45, lateral)},
          {"upright", feet}};
}

}  // namespace supine::diagnosis
