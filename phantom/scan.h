// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "common/landmarks.h"
#include "phantom/body_mesh.h"
#include "phantom/random_field.h"
#include "reconstruction/surface.h"

namespace supine::phantom {

/// How well landmarks are found.
struct LandmarkError {
  double sigma_mm = 0.2;  ///< in every direction
  bool stated = false;    ///< in the file
};

struct ScanOptions {
  double noise_mm = 0.7;                 ///< along the normal, 1 sigma
  double isotropic_mm = 0.2;             ///< in every direction, 1 sigma
  std::vector<RandomField> shared = {};  ///< mm along the normal by the place in the pose: what points err together
  LandmarkError landmarks = {};
};

/// What a scanner sees of one pose: the skin with noise, less two to four round holes, most of them below the breast.
struct Scan {
  reconstruction::Surface surface;
  Landmarks landmarks;
};

/// @param pose  name; noise and holes differ from pose to pose
Scan scan_pose(const BodyMesh& body_mesh, const Body& body, const std::string& pose, const Points& x,
               std::uint64_t seed, const ScanOptions& options);

/// The nipple and four skin points half way to the foot, where the nodes are at @p x.
Landmarks mark_skin(const BodyMesh& body_mesh, const Body& body, const std::string& pose, const Points& x,
                    std::uint64_t seed, const LandmarkError& error = {});

}  // namespace supine::phantom
