// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/perforators.h"

#include <gtest/gtest.h>

#include <cmath>

#include "segmentation/tissue.h"
#include "tests/reconstruction/volumes.h"

namespace supine::reconstruction {
namespace {

using segmentation::LabelImage;
using segmentation::Tissue;

// A dome on its slab with a vessel of 2 mm that runs 5 mm into the muscle.
LabelImage dome_with_vessel(double vessel_mm) {
  return testing::voxelise(testing::cubic_grid(Eigen::Vector3d(44, 36, 44), 0.75), [=](const Eigen::Vector3d& at) {
    if (std::hypot(at.x() - 3, at.z()) < 0.5 * vessel_mm && at.y() > -4 && at.y() < 5) return Tissue::vessel;
    return testing::dome_on_slab(at);
  });
}

TEST(Perforators, VesselInTheMuscleBecomesMuscleAndNothingElseChanges) {
  LabelImage image = dome_with_vessel(2);
  const LabelImage before = image;
  const double turned_mm3 = turn_perforators_into_muscle(image, 3);
  EXPECT_NEAR(turned_mm3, M_PI * 5, 5);
  double changed_mm3 = 0;
  for (std::size_t v = 0; v < image.voxels.size(); ++v) {
    if (image.voxels[v] == before.voxels[v]) continue;
    changed_mm3 += image.grid.voxel_volume_mm3();
    EXPECT_EQ(image.voxels[v], static_cast<int>(Tissue::muscle));
    EXPECT_EQ(before.voxels[v], static_cast<int>(Tissue::vessel));
  }
  EXPECT_DOUBLE_EQ(changed_mm3, turned_mm3);
}

TEST(Perforators, ThickOnesAndTheOptionZeroLeaveTheImageAlone) {
  LabelImage thick = dome_with_vessel(8), thin = dome_with_vessel(2);
  EXPECT_EQ(turn_perforators_into_muscle(thick, 3), 0);
  EXPECT_EQ(turn_perforators_into_muscle(thin, 0), 0);
}

}  // namespace
}  // namespace supine::reconstruction
