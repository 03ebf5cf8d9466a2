// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "phantom/body_mesh.h"
#include "segmentation/image.h"

namespace supine::phantom {

/// Values of the labels file.
enum class Label : std::uint8_t { air = 0, adipose = 1, gland = 2, muscle = 3, skin = 4, excluded = 5, tumour = 6 };

struct VoxelOptions {
  double voxel_mm = 1.5;
  double grown_mm = 0;  ///< the skin in the labels lies so far outside the true one; < 0 = inside
};

/// Labels of the body in its prone shape: a voxel is inside where its centre is. Skin is what lies within its 1.5 mm;
/// muscle goes from the inner surface, also where that hangs off the muscle, to 14 mm behind the muscle's face;
/// excluded goes on 12 mm behind the wall at the rim. The grid's axes are the patient's, its origin is off the body by
/// a drawn part of a voxel.
segmentation::LabelImage label_voxels(const BodyMesh& body_mesh, const Body& body, const Points& prone,
                                      std::uint64_t seed, const VoxelOptions& options);

}  // namespace supine::phantom
