// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

#include "reconstruction/surface.h"
#include "segmentation/image.h"
#include "segmentation/tissue.h"

namespace supine::testing {

using TissueAt = std::function<segmentation::Tissue(const Eigen::Vector3d&)>;

/// A grid of cubic voxels along the patient's axes that holds the box ± half_mm around the origin.
segmentation::Grid cubic_grid(const Eigen::Vector3d& half_mm, double voxel_mm);

/// The tissue at every voxel's centre (patient coordinates).
segmentation::LabelImage voxelise(const segmentation::Grid& grid, const TissueAt& tissue);

/// A half ball of adipose (radius 30 mm, dome toward −y) with 3 mm of skin on a muscle slab y > 0; the slab reaches
/// 40 mm from the axis, beyond it is air.
segmentation::Tissue dome_on_slab(const Eigen::Vector3d& at);

/// Sphere around the origin, subdivided icosahedron, outward.
reconstruction::Surface ball(double radius_mm, int subdivisions);

/// The message of the InputError that @p action throws; empty when it throws none.
std::string message_of(const std::function<void()>& action);

}  // namespace supine::testing
