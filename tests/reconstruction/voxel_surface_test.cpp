// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/voxel_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "reconstruction/surface_check.h"
#include "tests/reconstruction/volumes.h"

namespace supine::reconstruction {
namespace {

using segmentation::Grid;
using segmentation::LabelImage;
using segmentation::Tissue;
using testing::cubic_grid;
using testing::voxelise;

LabelImage label_ball(const Grid& grid, double radius_mm) {
  return voxelise(grid,
                  [=](const Eigen::Vector3d& at) { return at.norm() < radius_mm ? Tissue::adipose : Tissue::air; });
}

TEST(VoxelSurface, OneVoxelIsAnOctahedron) {
  LabelImage image{{}, std::vector<std::uint8_t>(27, 0)};
  image.grid.size.setConstant(3);
  image.grid.spacing_mm = {1, 2, 3};
  image.at(1, 1, 1) = static_cast<std::uint8_t>(Tissue::tumour);
  const VoxelSurface one = voxel_surface(image, only(Tissue::tumour));
  EXPECT_EQ(one.surface.triangles.rows(), 8);
  EXPECT_EQ(one.surface.points.rows(), 6);
  EXPECT_DOUBLE_EQ(check_surface(one.surface).volume_mm3, 1.0);  // 1/6 of 1 × 2 × 3
  EXPECT_DOUBLE_EQ(one.voxel_volume_mm3(), 6);
  EXPECT_EQ((one.inside.array() - 1).abs().maxCoeff(), 0);
  EXPECT_TRUE(((one.outside - one.inside).rowwise().lpNorm<1>().array() == 1).all());
}

TEST(VoxelSurface, StaircaseOfABallHasItsVolumeAndFarMoreThanItsArea) {
  const double volume = 4.0 / 3 * std::numbers::pi * 20 * 20 * 20, area = 4 * std::numbers::pi * 20 * 20;
  const VoxelSurface surface =
      voxel_surface(label_ball(cubic_grid(Eigen::Vector3d::Constant(20), 1), 20), meshed_tissues());
  const SurfaceReport report = check_surface(surface.surface);
  EXPECT_NEAR(report.volume_mm3 / volume, 1, 0.003);
  // The area of a binary staircase does not converge: 8.8 % too much at every voxel size.
  EXPECT_NEAR(report.area_mm2 / area, 1.087, 0.006);
  EXPECT_EQ(report.euler, 2);
}

TEST(VoxelSurface, NoiseStaysManifoldAndKeepsEveryPiece) {
  LabelImage image{{}, {}};
  image.grid.size.setConstant(24);
  std::mt19937 random(7);
  for (std::size_t v = 0; v < image.grid.count(); ++v) image.voxels.push_back(random() % 2);
  const VoxelSurface noise = voxel_surface(image, only(Tissue::adipose));
  const SurfaceReport report = check_surface(noise.surface);
  EXPECT_TRUE(report.closed());
  EXPECT_TRUE(report.manifold());
  EXPECT_EQ(report.components - report.cavities, static_cast<int>(noise.piece_volume_mm3.size()));
}

TEST(VoxelSurface, SmallPiecesAreDroppedAndCounted) {
  const Grid grid = cubic_grid(Eigen::Vector3d(30, 12, 12), 1);
  const LabelImage image = voxelise(grid, [](const Eigen::Vector3d& at) {
    const bool large = (at - Eigen::Vector3d(-10, 0, 0)).norm() < 10,
               small = (at - Eigen::Vector3d(20, 0, 0)).norm() < 2;
    return large || small ? Tissue::adipose : Tissue::air;
  });
  const VoxelSurface all = voxel_surface(image, meshed_tissues()), large = voxel_surface(image, meshed_tissues(), 100);
  EXPECT_EQ(all.piece_volume_mm3.size(), 2);
  EXPECT_EQ(large.piece_volume_mm3.size(), 1);
  EXPECT_EQ(large.dropped_pieces, 1);
  EXPECT_DOUBLE_EQ(large.dropped_volume_mm3 + large.voxel_volume_mm3(), all.voxel_volume_mm3());
  EXPECT_EQ(voxel_surface(image, meshed_tissues(), 1e9).piece_volume_mm3.size(), 1) << "the largest stays in any case";
}

TEST(VoxelSurface, FlippedObliqueAndLeftHandedAxesGiveAnOutwardSurfaceInItsPlace) {
  Eigen::Matrix3d flip = Eigen::Vector3d(1, -1, 1).asDiagonal();
  const Eigen::Matrix3d oblique = Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const Eigen::Matrix3d& direction : {Eigen::Matrix3d(oblique), flip, Eigen::Matrix3d(oblique * flip)}) {
    Grid grid;
    grid.size = {40, 44, 30};
    grid.spacing_mm = {1, 1, 1.5};
    grid.direction = direction;
    grid.origin_mm = Eigen::Vector3d(5, -7, 100) - direction * Eigen::Vector3d(20, 22, 22);
    const Eigen::Vector3d centre(5, -7, 100);
    const LabelImage image = voxelise(
        grid, [&](const Eigen::Vector3d& at) { return (at - centre).norm() < 15 ? Tissue::adipose : Tissue::air; });
    const Surface surface = to_patient(voxel_surface(image, meshed_tissues()).surface, grid);
    EXPECT_NEAR(check_surface(surface).volume_mm3, 4.0 / 3 * std::numbers::pi * 15 * 15 * 15, 150);
    EXPECT_NEAR((surface.points.colwise().mean().transpose() - centre).norm(), 0, 0.5);
  }
}

}  // namespace
}  // namespace supine::reconstruction
