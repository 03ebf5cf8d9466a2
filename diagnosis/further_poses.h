// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace supine::diagnosis {

/// A pose that a patient could be scanned in as well.
struct FurtherPose {
  std::string name;
  Eigen::Vector3d down;  ///< unit, LPS
};

/// Tilted by 45° with the head up and to the outer side, and upright.
/// @param down     gravity of the pose that is known, unit, LPS
/// @param lateral  to the outer side, unit, LPS
std::vector<FurtherPose> further_poses(const Eigen::Vector3d& down, const Eigen::Vector3d& lateral);

}  // namespace supine::diagnosis
