// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "common/landmarks.h"
#include "phantom/body_mesh.h"
#include "phantom/cause.h"
#include "reconstruction/surface.h"

namespace supine::phantom {

struct ScanOptions {
  double noise_mm = 0.7;      ///< along the normal, 1 sigma
  double isotropic_mm = 0.2;  ///< in every direction, 1 sigma
};

/// What a scanner sees of one pose: the skin with noise, less two to four round holes, most of them below the breast.
struct Scan {
  reconstruction::Surface surface;
  Landmarks landmarks;
};

/// @param pose    name; noise and holes differ from pose to pose
/// @param causes  misregistration moves scan and landmarks about the scan's centroid, in every pose in a way of its
/// own:
///   in supine by the cause's values, in others by numbers drawn for that pose
Scan scan_pose(const BodyMesh& body_mesh, const Body& body, const std::string& pose, const Points& x,
               const std::vector<Cause>& causes, std::uint64_t seed, const ScanOptions& options);

/// The nipple and four skin points half way to the foot, where the nodes are at @p x; 0.2 mm of noise.
Landmarks mark_skin(const BodyMesh& body_mesh, const Body& body, const std::string& pose, const Points& x,
                    std::uint64_t seed);

}  // namespace supine::phantom
