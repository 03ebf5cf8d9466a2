// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/warp_volume.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "simulation/embedding.h"
#include "tests/warp/two_shapes.h"

namespace supine::warp {
namespace {

using segmentation::Grid;
using testing::affine;
using testing::affine_back;
using testing::bent;

double ramp(const Eigen::Vector3d& p) { return 300 + 2 * p.x() - 3 * p.y() + 1.5 * p.z(); }

class WarpVolume : public ::testing::TestWithParam<int> {};

// A linear volume is held exactly by linear interpolation, so only the map can be wrong: its sense above all.
TEST_P(WarpVolume, ShowsEveryVoxelWhatTheModelHasThere) {
  const testing::MovedBox box = testing::moved_box(GetParam(), affine);
  const auto volume = testing::volume_of(testing::grid_over({-30, -30, -30}, 100, 2.3), ramp);
  const Grid grid = testing::grid_over({-25, -20, -20}, 90, 3.1);
  const WarpedVolume warped = warp_volume(box.shapes(), volume, grid, {});
  std::size_t inside = 0;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const Eigen::Vector3d from = affine_back(grid.point(Eigen::Vector3d(i, j, k)));
        if (from.minCoeff() < 0 || from.maxCoeff() > 40) continue;
        ++inside;
        ASSERT_NEAR(warped.image.at(i, j, k), ramp(from), 2e-3) << i << " " << j << " " << k;
      }
  EXPECT_GT(inside, 1000u);
  EXPECT_EQ(warped.body_voxels, inside);
  EXPECT_EQ(warped.unseen_voxels, 0u);
  EXPECT_EQ(warped.overlap.voxels, 0u);
}

TEST_P(WarpVolume, AgreesWithPointsFoundOneByOne) {
  const testing::MovedBox box = testing::moved_box(GetParam(), bent);
  const auto volume = testing::volume_of(testing::grid_over({-30, -30, -30}, 100, 2.3), ramp);
  const Grid grid = testing::grid_over({-5, -5, -5}, 60, 4.1);
  const WarpedVolume warped = warp_volume(box.shapes(), volume, grid, {});
  Points voxels(static_cast<Eigen::Index>(grid.count()), 3);
  for (Eigen::Index v = 0; v < voxels.rows(); ++v) {
    const int row = grid.size.x(), slice = row * grid.size.y(), n = static_cast<int>(v);
    voxels.row(v) = grid.point(Eigen::Vector3d(n % row, n % slice / row, n / slice)).transpose();
  }
  meshing::TetMesh body = box.mesh;
  body.points = box.target;
  const simulation::Embedding embedding(body, voxels);
  const Points from = embedding.at(box.mesh.points);
  std::size_t inside = 0;
  for (Eigen::Index v = 0; v < voxels.rows(); ++v) {
    if (embedding.outside_mm()[v] > 0) continue;
    ++inside;
    ASSERT_NEAR(warped.image.voxels[static_cast<std::size_t>(v)], ramp(from.row(v).transpose()), 0.02) << v;
  }
  // VTK's locator takes a point some micrometres outside for one inside.
  EXPECT_NEAR(static_cast<double>(warped.body_voxels), static_cast<double>(inside), 5);
}

// An organ whose label is carried ends within half a voxel of where the carried organ ends.
TEST_P(WarpVolume, LabelsEndWhereTheOrganDoes) {
  const testing::MovedBox box = testing::moved_box(GetParam(), affine);
  const Eigen::Vector3d middle(20, 18, 22);
  constexpr double radius = 12, spacing = 1.2;
  const auto labels = testing::volume_of(testing::grid_over({-10, -10, -10}, 60, spacing),
                                         [&](const auto& p) { return (p - middle).norm() < radius ? 29.0 : 1.0; });
  const Grid grid = testing::grid_over({-15, -15, -15}, 75, 1.5);
  WarpOptions options;
  options.interpolation = Interpolation::nearest;
  options.background = 0.0F;
  const WarpedVolume warped = warp_volume(box.shapes(), labels, grid, options);
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const Eigen::Vector3d from = affine_back(grid.point(Eigen::Vector3d(i, j, k)));
        if (from.minCoeff() < 0.1 || from.maxCoeff() > 39.9) continue;
        const double depth = radius - (from - middle).norm();
        const float value = warped.image.at(i, j, k);
        ASSERT_TRUE(value == 29 || value == 1) << "labels are not mixed";
        if (std::abs(depth) > 0.5 * std::sqrt(3.0) * spacing) {
          ASSERT_EQ(value == 29, depth > 0) << depth;
        }
      }
}

INSTANTIATE_TEST_SUITE_P(Orders, WarpVolume, ::testing::Values(1, 2));

TEST(WarpVolumeAround, StaysFarAwayAndIsEmptyWhereTheBodyHasLeft) {
  const Eigen::Vector3d far(60, 0, 0);
  const testing::MovedBox box = testing::moved_box(1, [&](const auto& x) { return Eigen::Vector3d(x + far); });
  Grid grid;
  grid.spacing_mm.setConstant(2);
  grid.origin_mm.setConstant(-31);
  grid.size = {90, 50, 50};
  const auto volume = testing::volume_of(
      grid, [](const auto& p) { return p.minCoeff() > 0 && p.maxCoeff() < 40 ? 500.0 : 10 + 0.1 * p.z(); });
  const WarpedVolume warped = warp_volume(box.shapes(), volume, grid, {});
  const auto at = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3i i = grid.continuous_index(p).array().round().cast<int>();
    return std::pair(warped.image.at(i.x(), i.y(), i.z()), volume.at(i.x(), i.y(), i.z()));
  };
  EXPECT_FLOAT_EQ(at({80, 20, 20}).first, 500) << "where it went";
  EXPECT_FLOAT_EQ(at({20, 20, 20}).first, *std::min_element(volume.voxels.begin(), volume.voxels.end()))
      << "where it was: the least value, not the body again";
  EXPECT_FLOAT_EQ(at({20, 60, 60}).first, at({20, 60, 60}).second) << "far from both";
  EXPECT_GT(warped.left_voxels, 5000u);
  // Just beside the body its surroundings went along, so its skin is not smeared.
  EXPECT_LT(at({101, 20, 20}).first, 20);
}

TEST(WarpVolumeAround, TellsWhereAShapeLiesInItself) {
  const testing::MovedBox box = testing::moved_box(
      1, [](const Eigen::Vector3d& x) { return Eigen::Vector3d(x.x(), x.y(), std::abs(x.z() - 15)); });
  const auto volume = testing::volume_of(testing::grid_over({-10, -10, -10}, 60, 3), ramp);
  const WarpedVolume warped = warp_volume(box.shapes(), volume, volume.grid, {});
  EXPECT_GT(warped.overlap.voxels, 50u);
  EXPECT_GT(warped.overlap.place_mm.minCoeff(), 0);
  EXPECT_LT(warped.overlap.place_mm.z(), 15);
}

TEST(WarpVolumeGrid, GrowsByWholeVoxelsAndKeepsItsLattice) {
  const Grid grid = testing::grid_over({0, 0, 0}, 30, 2);
  const testing::MovedBox box = testing::moved_box(1, affine);
  const Grid grown = grown_to_hold(grid, box.target, 4);
  const Eigen::Vector3d first = grid.continuous_index(grown.origin_mm);
  EXPECT_LT((first - first.array().round().matrix()).norm(), 1e-9);
  for (Eigen::Index p = 0; p < box.target.rows(); ++p) {
    const Eigen::Vector3d index = grown.continuous_index(box.target.row(p).transpose());
    EXPECT_GE(index.minCoeff(), 2 - 1e-9);
    EXPECT_GE((grown.size.cast<double>() - index).minCoeff(), 3 - 1e-9);
  }
  const Grid finer = with_spacing(grid, {1, 2, 0.5});
  EXPECT_EQ(finer.size, Eigen::Vector3i(31, 16, 61));
}

TEST(WarpVolumeGrid, RefusesWhatDoesNotFitIntoMemoryAndSaysWhatWould) {
  Grid grid;
  grid.size = {40000, 40000, 40000};
  grid.spacing_mm.setConstant(0.01);
  try {
    check_memory(grid, 10);
    FAIL() << "640 TB";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--spacing"), std::string::npos) << error.what();
  }
  grid.size = {100, 100, 100};
  EXPECT_NO_THROW(check_memory(grid, 10));
}

TEST(SkinContrast, IsHighOnTheOwnBodyAndNotOnAnother) {
  const testing::MovedBox box = testing::moved_box(1, affine);
  const auto volume = testing::volume_of(testing::grid_over({-30, -30, -30}, 100, 2), [](const auto& p) {
    return p.minCoeff() > 0 && p.maxCoeff() < 40 ? 500.0 : 3.0;
  });
  EXPECT_GT(skin_contrast(box.mesh, box.mesh.points, volume), 0.95);
  EXPECT_LT(skin_contrast(box.mesh, box.target, volume), 0.8);
}

}  // namespace
}  // namespace supine::warp
