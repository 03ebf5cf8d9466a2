// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/handles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruction/reconstruct.h"
#include "tests/reconstruction/volumes.h"

namespace supine::reconstruction {
namespace {

using segmentation::LabelImage;
using segmentation::Tissue;

constexpr double voxel_mm = 1.5;

// The dome on its slab with a tunnel of air through it along z and a ring of skin that stands off it along x.
LabelImage dome_with(double tunnel_mm, double strand_mm, double spacing_mm = voxel_mm) {
  const auto box = [](const Eigen::Vector3d& at, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    return ((at - low).array() > 0).all() && ((high - at).array() > 0).all();
  };
  return testing::voxelise(
      testing::cubic_grid(Eigen::Vector3d(45, 45, 45), spacing_mm), [=](const Eigen::Vector3d& at) {
        const double t = tunnel_mm / 2, s = strand_mm / 2;
        if (t > 0 && std::abs(at.x()) < t && std::abs(at.y() + 15) < t) return Tissue::air;
        if (s > 0 && (box(at, {-s, -40, 10 - s}, {s, -40 + 2 * s, 18 + s}) ||
                      box(at, {-s, -40, 10 - s}, {s, -20, 10 + s}) || box(at, {-s, -40, 18 - s}, {s, -15, 18 + s})))
          return Tissue::skin;
        return testing::dome_on_slab(at);
      });
}

TEST(Handles, SoundDomeStaysAsItIs) {
  LabelImage image = dome_with(0, 0);
  const std::vector<std::uint8_t> before = image.voxels;
  const HandleRepair repair = close_handles(image);
  EXPECT_EQ(repair.genus_before, 0);
  EXPECT_TRUE(repair.places_mm.empty());
  EXPECT_EQ(image.voxels, before);
}

TEST(Handles, TunnelOfOneVoxelIsFilledWithTheTissueAroundIt) {
  LabelImage image = dome_with(2 * voxel_mm, 0);
  const std::vector<std::uint8_t> before = image.voxels;
  const HandleRepair repair = close_handles(image);
  EXPECT_EQ(repair.genus_before, 1);
  EXPECT_EQ(repair.genus, 0);
  EXPECT_EQ(repair.removed_mm3, 0);
  ASSERT_EQ(repair.places_mm.size(), 1);
  EXPECT_LT(std::abs(repair.places_mm[0].x()) + std::abs(repair.places_mm[0].y() + 15), 2 * voxel_mm);
  double changed_mm3 = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    if (image.voxels[v] == before[v]) continue;
    EXPECT_EQ(before[v], static_cast<int>(Tissue::air));
    EXPECT_TRUE(is_meshed(static_cast<Tissue>(image.voxels[v])));
    changed_mm3 += std::pow(voxel_mm, 3);
  }
  EXPECT_DOUBLE_EQ(changed_mm3, repair.filled_mm3);
}

TEST(Handles, StrandThatHoldsOnAtBothEndsIsTakenAway) {
  LabelImage image = dome_with(0, 2.4);
  const HandleRepair repair = close_handles(image);
  EXPECT_EQ(repair.genus_before, 1);
  EXPECT_EQ(repair.genus, 0);
  EXPECT_GT(repair.removed_mm3 + repair.filled_mm3, 0);
}

TEST(Handles, SameTunnelIsFilledWhereVoxelsAreFiner) {
  constexpr double tunnel_mm = 4;
  for (const double spacing_mm : {voxel_mm, 0.75}) {
    LabelImage image = dome_with(tunnel_mm, 0, spacing_mm);
    const HandleRepair repair = close_handles(image);
    EXPECT_EQ(repair.genus_before, 1) << spacing_mm;
    EXPECT_EQ(repair.genus, 0) << spacing_mm;
    EXPECT_GT(repair.filled_mm3, 0) << spacing_mm;
  }
}

TEST(Handles, ThickTunnelIsLeftAndCounted) {
  LabelImage image = dome_with(12, 0);
  const std::vector<std::uint8_t> before = image.voxels;
  const HandleRepair repair = close_handles(image);
  EXPECT_EQ(repair.genus_before, 1);
  EXPECT_EQ(repair.genus, 1);
  EXPECT_EQ(image.voxels, before);
}

TEST(Handles, ReconstructionClosesThemUnlessToldNotTo) {
  const LabelImage image = dome_with(2 * voxel_mm, 0);
  ReconstructOptions options;
  options.cut.edge = options.cut.rim = true;
  EXPECT_EQ(reconstruct(image, options).breast.report.genus(), 0);
  options.thinnest_mm = 0;
  EXPECT_EQ(reconstruct(image, options).breast.report.genus(), 1);
}

}  // namespace
}  // namespace supine::reconstruction
