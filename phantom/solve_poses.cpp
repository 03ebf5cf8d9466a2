// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/solve_poses.h"

namespace supine::phantom {

void solve_poses(const BodyMesh& body_mesh, const Body& body, const PhantomOptions& options, Phantom& phantom,
                 Truth::Start start) {
  std::vector<TruthPose> poses = phantom.poses;
  Truth truth(body_mesh, body, phantom.causes, phantom.nuisances ? &*phantom.nuisances : nullptr);
  truth.solve(poses, start);
  if (options.prior) phantom.discrepancy.emplace(truth, body_mesh, poses, options.seed);
  phantom.poses = std::move(poses);
  phantom.body = body;
}

}  // namespace supine::phantom
