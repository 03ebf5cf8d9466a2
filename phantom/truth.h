// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <vector>

#include "phantom/cause.h"

namespace supine::phantom {

/// A body position of the phantom.
struct TruthPose {
  std::string name;
  Eigen::Vector3d gravity;  ///< unit, LPS, as the case file says
  Points x;                 ///< nodes, mm
};

/// prone, supine and, where wanted, tilt45; gravity only.
std::vector<TruthPose> truth_poses(bool tilt);

/// Base model of the truth; moduli of @p body.
simulation::Model truth_model(const Body& body);

/// Lets the stress-free body hang prone and lie in the other poses: one forward solve each, from no load.
/// @throws NumericalFailure  no equilibrium
void solve_truth(const BodyMesh& body_mesh, const Body& body, const std::vector<Cause>& causes,
                 std::vector<TruthPose>& poses);

}  // namespace supine::phantom
