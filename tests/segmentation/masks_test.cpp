// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/masks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace supine::segmentation {
namespace {

Grid grid_of(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm = Eigen::Vector3d::Ones()) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  return grid;
}

std::size_t count(const Mask& mask) { return static_cast<std::size_t>(std::count(mask.begin(), mask.end(), 1)); }

/// Voxels whose centre is within radius of the centre of the image.
Mask ball(const Grid& grid, double radius_mm) {
  const Eigen::Vector3d centre = grid.point((grid.size - Eigen::Vector3i::Ones()).cast<double>() / 2);
  Mask mask(grid.count());
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i)
        mask[grid.index(i, j, k)] = (grid.point(Eigen::Vector3d(i, j, k)) - centre).norm() <= radius_mm;
  return mask;
}

/// A random mask with a third of its voxels in.
Mask scatter(const Grid& grid, unsigned seed) {
  std::mt19937 generator(seed);
  Mask mask(grid.count());
  for (auto& v : mask) v = generator() % 3 == 0;
  return mask;
}

TEST(Masks, ComponentsTouchThroughFacesNotEdges) {
  const Grid grid = grid_of({4, 3, 2});
  Mask mask(grid.count(), 0);
  mask[grid.index(0, 0, 0)] = mask[grid.index(1, 0, 0)] = mask[grid.index(1, 0, 1)] = 1;
  mask[grid.index(2, 1, 0)] = 1;  // shares an edge only
  const Components components = connected_components(mask, grid);
  EXPECT_EQ(components.size, (std::vector<std::size_t>{3, 1}));
  EXPECT_EQ(components.number[grid.index(1, 0, 1)], 1);
  EXPECT_EQ(components.number[grid.index(2, 1, 0)], 2);
  EXPECT_EQ(components.number[grid.index(3, 2, 1)], 0);
}

TEST(Masks, ComponentsAgreeWithFloods) {
  const Grid grid = grid_of({13, 11, 9});
  const Mask mask = scatter(grid, 7);
  const Components components = connected_components(mask, grid);
  ASSERT_GT(components.size.size(), 20u);
  for (std::size_t n = 0; n < mask.size(); ++n) {
    if (!mask[n]) continue;
    const std::size_t seed[] = {n};
    ASSERT_EQ(count(flood(mask, grid, seed)), components.size[static_cast<std::size_t>(components.number[n]) - 1]);
  }
  EXPECT_EQ(component_counts(mask, grid)[1], components.size.size());
}

TEST(Masks, SnakeIsOneComponent) {
  // A path that turns back on itself joins runs late.
  const Grid grid = grid_of({7, 5, 1});
  Mask mask(grid.count(), 0);
  for (int i = 0; i < 7; ++i) mask[grid.index(i, 0, 0)] = mask[grid.index(i, 2, 0)] = mask[grid.index(i, 4, 0)] = 1;
  mask[grid.index(6, 1, 0)] = mask[grid.index(0, 3, 0)] = 1;
  EXPECT_EQ(connected_components(mask, grid).size, (std::vector<std::size_t>{23}));
}

TEST(Masks, FloodStaysInsideItsWalls) {
  const Grid grid = grid_of({5, 5, 5});
  Mask allowed(grid.count(), 1);
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 5; ++j) allowed[grid.index(2, j, k)] = 0;
  const std::size_t seeds[] = {grid.index(0, 0, 0)};
  EXPECT_EQ(count(flood(allowed, grid, seeds)), 50u);
  const std::size_t blocked[] = {grid.index(2, 0, 0)};
  EXPECT_EQ(count(flood(allowed, grid, blocked)), 0u);
}

TEST(Masks, IslandsByNumberAndBySize) {
  const Grid grid = grid_of({9, 1, 1});
  const Mask mask = {1, 1, 1, 0, 1, 0, 1, 1, 0};
  EXPECT_EQ(keep_islands(mask, grid, 1, 0), (Mask{1, 1, 1, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(keep_islands(mask, grid, 0, 2), (Mask{1, 1, 1, 0, 0, 0, 1, 1, 0}));
  EXPECT_EQ(keep_islands(mask, grid, 2, 3), (Mask{1, 1, 1, 0, 0, 0, 0, 0, 0}));
}

TEST(Masks, HolesUpToASizeAndNeverThroughTheEdge) {
  const Grid grid = grid_of({9, 9, 9});
  const Mask full = ball(grid, 3.5);
  Mask hollow = full;
  hollow[grid.index(4, 4, 4)] = hollow[grid.index(4, 4, 5)] = 0;
  EXPECT_EQ(fill_holes(hollow, grid, 2), full);
  EXPECT_EQ(fill_holes(hollow, grid, 1), hollow);
  EXPECT_EQ(fill_holes(hollow, grid, std::numeric_limits<double>::infinity()), full);
}

TEST(Masks, DistancesAreExactOnAnisotropicVoxels) {
  const Grid grid = grid_of({9, 8, 5}, {0.7, 0.7, 4});
  Mask mask(grid.count(), 0);
  const std::vector<Eigen::Vector3i> points = {{1, 2, 0}, {7, 6, 3}, {4, 0, 4}};
  for (const auto& p : points) mask[grid.index(p.x(), p.y(), p.z())] = 1;
  const auto squared = squared_distance_mm2(mask, grid);
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 9; ++i) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& p : points)
          nearest = std::min(nearest,
                             grid.spacing_mm.cwiseProduct((Eigen::Vector3i(i, j, k) - p).cast<double>()).squaredNorm());
        EXPECT_NEAR(squared[grid.index(i, j, k)], nearest, 1e-4);
      }
  EXPECT_TRUE(std::isinf(squared_distance_mm2(Mask(grid.count(), 0), grid)[0]));
}

TEST(Masks, BallGrowsAndShrinksToTheVolumeOfItsRadius) {
  for (const Eigen::Vector3d& spacing : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0.7, 0.7, 4)}) {
    const Grid grid = grid_of((60 * spacing.cwiseInverse()).array().ceil().cast<int>() + 1, spacing);
    const auto volume_mm3 = [&](const Mask& mask) {
      return static_cast<double>(count(mask)) * grid.voxel_volume_mm3();
    };
    const auto exact_mm3 = [](double r) { return 4.0 / 3 * std::numbers::pi * r * r * r; };
    const Mask mask = ball(grid, 15);
    // Voxel counts of a ball scatter by less than 2 % of its volume at these sizes.
    EXPECT_NEAR(volume_mm3(mask) / exact_mm3(15), 1, 0.02);
    // Growing from voxel centres falls short by at most half a voxel diagonal, shrinking likewise.
    const double slack_mm = spacing.norm() / 2;
    const Mask large = dilate(mask, grid, 8), small = erode(mask, grid, 8);
    EXPECT_GT(volume_mm3(large), exact_mm3(23 - slack_mm));
    EXPECT_LT(volume_mm3(large), exact_mm3(23) * 1.02);
    EXPECT_GT(volume_mm3(small), exact_mm3(7) * 0.95);
    EXPECT_LT(volume_mm3(small), exact_mm3(7 + slack_mm) * 1.05);
  }
}

TEST(Masks, RadiusOfWholeVoxelsReachesThem) {
  const Grid grid = grid_of({9, 1, 1}, {1.5, 1, 1});
  const Mask mask = {0, 0, 0, 0, 1, 0, 0, 0, 0};
  EXPECT_EQ(dilate(mask, grid, 3.0), (Mask{0, 0, 1, 1, 1, 1, 1, 0, 0}));
  EXPECT_EQ(erode(dilate(mask, grid, 3.0), grid, 3.0), mask);
}

}  // namespace
}  // namespace supine::segmentation
