// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/solve_poses.h"

#include <optional>
#include <utility>

namespace supine::phantom {

void solve_poses(const BodyMesh& body_mesh, const Body& body, const PhantomOptions& options, Phantom& phantom,
                 Truth::Start start) {
  std::vector<TruthPose> poses = phantom.poses;
  Truth truth(body_mesh, body, phantom.causes, phantom.nuisances ? &*phantom.nuisances : nullptr);
  truth.solve(poses, start);
  std::optional<Discrepancy> drawn;
  if (options.prior) drawn.emplace(truth, body_mesh, poses, options.seed);
  phantom.discrepancy = std::move(drawn);
  phantom.poses = std::move(poses);
  phantom.body = body;
}

}  // namespace supine::phantom
