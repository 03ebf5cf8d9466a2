// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/moved_fat.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace supine::segmentation {
namespace {

using Eigen::Vector3d;

constexpr double pure = 0.6;

Grid grid_of(const Eigen::Vector3i& size, const Vector3d& spacing_mm) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  return grid;
}

Grid thick_slices() { return grid_of({70, 60, 14}, {1.2, 1.2, 3.6}); }

/// Strands some 5 mm wide that bend, with soft flanks, in the middle of the series.
double gland_at(const Vector3d& p) {
  if ((p.head<2>() - Eigen::Vector2d(42, 36)).norm() > 28) return 0;
  const double a = std::sin(p.x() / 4 + std::sin(p.y() / 9)),
               b = std::sin(p.y() / 5 + std::cos(p.x() / 8 + p.z() / 15));
  return 1 / (1 + std::exp(-12 * (a * b - 0.25)));
}

/// Grids whose first axis is the shortest have the same gland with x and z exchanged.
struct Series {
  Grid grid;
  std::vector<float> contrast, gland;
  Mask within;

  explicit Series(const Vector3d& fat_mm, const Grid& on = thick_slices()) : grid(on) {
    std::mt19937 random(5);
    std::normal_distribution<double> scatter(0, 0.03);
    const bool exchanged = grid.size.x() < grid.size.z();
    const auto gland_there = [exchanged](const Vector3d& p) { return gland_at(exchanged ? p.reverse().eval() : p); };
    for (int k = 0; k < grid.size.z(); ++k)
      for (int j = 0; j < grid.size.y(); ++j)
        for (int i = 0; i < grid.size.x(); ++i) {
          const Vector3d p = grid.point(Vector3d(i, j, k));
          gland.push_back(static_cast<float>(gland_there(p)));
          contrast.push_back(static_cast<float>(gland_there(p - fat_mm) - (1 - pure) * gland.back() + scatter(random)));
          within.push_back(std::hypot((exchanged ? p.z() : p.x()) - 42, p.y() - 36) < 33);
        }
  }

  double rms_error(const std::vector<float>& share, double scale = 1) const {
    double sum = 0, count = 0;
    for (std::size_t n = 0; n < share.size(); ++n)
      if (within[n]) sum += std::pow(scale * share[n] - gland[n], 2), ++count;
    return std::sqrt(sum / count);
  }
};

TEST(MovedFat, IsToldFromTheOneSeriesAndGlandIsPutBack) {
  for (const Vector3d& fat_mm :
       {Vector3d(1.8, 0, 0), Vector3d(-1.5, 0, 0), Vector3d(0, 1.8, 0), Vector3d(0, -2.1, 0)}) {
    const Series series(fat_mm);
    const auto found = find_moved_fat(series.contrast, series.within, series.grid, pure);
    ASSERT_TRUE(found) << fat_mm.transpose();
    EXPECT_LT((found->fat_mm - fat_mm).norm(), 0.31) << found->fat_mm.transpose() << " for " << fat_mm.transpose();
    EXPECT_LT(series.rms_error(found->share), 0.4 * series.rms_error(series.contrast, 1 / pure)) << fat_mm.transpose();
  }
}

TEST(MovedFat, OutsideTheMaskIsNone) {
  const Series series(Vector3d(1.8, 0, 0));
  const auto found = find_moved_fat(series.contrast, series.within, series.grid, pure);
  ASSERT_TRUE(found);
  for (std::size_t n = 0; n < series.within.size(); ++n) {
    if (series.within[n]) continue;
    ASSERT_EQ(found->share[n], 0) << n;
  }
}

TEST(MovedFat, IsNotToldWhereNoneMovedWhereThereIsNoGlandOrHardlyAVoxel) {
  const Series in_place(Vector3d::Zero());
  EXPECT_FALSE(find_moved_fat(in_place.contrast, in_place.within, in_place.grid, pure));
  Series fat(Vector3d::Zero());
  std::mt19937 random(7);
  std::normal_distribution<float> scatter(0, 0.05F);
  for (float& c : fat.contrast) c = scatter(random);
  EXPECT_FALSE(find_moved_fat(fat.contrast, fat.within, fat.grid, pure));
  Series some(Vector3d(1.8, 0, 0));  // 720 voxels in the middle of the gland
  for (int k = 0; k < 14; ++k)
    for (int j = 0; j < 60; ++j)
      for (int i = 0; i < 70; ++i)
        some.within[some.grid.index(i, j, k)] = k == 6 && j >= 18 && j < 42 && i >= 20 && i < 50;
  EXPECT_FALSE(find_moved_fat(some.contrast, some.within, some.grid, pure));
}

TEST(MovedFat, IsLookedForAlongSlicesThatAreThinAndNotAcrossThickOnes) {
  const Vector3d fat_mm(0, 0, 1.8);
  const Series thin(fat_mm, grid_of({14, 60, 70}, {1.2, 1.2, 1.2}));
  const auto found = find_moved_fat(thin.contrast, thin.within, thin.grid, pure);
  ASSERT_TRUE(found);
  EXPECT_LT((found->fat_mm - fat_mm).norm(), 0.31) << found->fat_mm.transpose();
  const Series thick(fat_mm, grid_of({14, 60, 46}, {1.2, 1.2, 1.85}));
  EXPECT_FALSE(find_moved_fat(thick.contrast, thick.within, thick.grid, pure));
}

}  // namespace
}  // namespace supine::segmentation
