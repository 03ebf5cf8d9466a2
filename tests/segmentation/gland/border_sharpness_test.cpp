// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/border_sharpness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "segmentation/blur.h"

namespace supine::segmentation {
namespace {

/// Fat in a cube 80 mm wide with a lobe of gland, a strand of it, and a corner where suppression fails: contrast that
/// falls over centimetres.
struct Breast {
  Grid grid;
  FatLevel fat;
  Mask inner, looks, failed;

  Breast(const Eigen::Vector3d& spacing_mm, double failed_at_x_mm) {
    grid.spacing_mm = spacing_mm;
    grid.size = (80 / spacing_mm.array()).round().cast<int>();
    inner.assign(grid.count(), 1);
    fat.contrast.assign(grid.count(), 0);
    fat.deviation.assign(grid.count(), 0.05F);
    std::vector<float> gland(grid.count(), 0), fails(grid.count(), 0);
    for_each_voxel([&](std::size_t n, const Eigen::Vector3d& p) {
      const bool lobe = (p - Eigen::Vector3d(25, 40, 40)).norm() < 12;
      const bool strand = std::hypot(p.y() - 40, p.z() - 40) < 2.5 && p.x() > 25 && p.x() < 50;
      gland[n] = lobe || strand ? 1.0F : 0.0F;
      fails[n] = static_cast<float>(std::exp(-(p - Eigen::Vector3d(failed_at_x_mm, 40, 40)).squaredNorm() / 300));
    });
    std::vector<float> sharp = gland;
    gaussian_blur(gland, grid, 1);  // as a scanner does
    std::mt19937 random(3);
    std::normal_distribution<float> noise(0, 0.05F);
    looks.assign(grid.count(), 0);
    failed.assign(grid.count(), 0);
    for (std::size_t n = 0; n < looks.size(); ++n) {
      fat.contrast[n] = gland[n] + fails[n] + noise(random);
      looks[n] = gland[n] + fails[n] > 0.2F;
      failed[n] = looks[n] && sharp[n] == 0 && fails[n] > 0.2F;
    }
  }

  template <class Work>
  void for_each_voxel(Work work) const {
    for (int k = 0; k < grid.size.z(); ++k)
      for (int j = 0; j < grid.size.y(); ++j)
        for (int i = 0; i < grid.size.x(); ++i) work(grid.index(i, j, k), grid.point(Eigen::Vector3d(i, j, k)));
  }

  /// Shares of the gland and of the failed suppression that are kept.
  std::pair<double, double> kept() const {
    const Mask sharp = with_sharp_borders(looks, inner, fat, grid);
    double gland = 0, of_gland = 0, fails = 0, of_fails = 0;
    for (std::size_t n = 0; n < looks.size(); ++n) {
      EXPECT_LE(sharp[n], looks[n]);
      (failed[n] ? fails : gland) += sharp[n];
      (failed[n] ? of_fails : of_gland) += looks[n];
    }
    return {gland / of_gland, fails / of_fails};
  }
};

TEST(BorderSharpness, GlandIsKeptAndSuppressionThatFailsLittleByLittleIsNot) {
  for (const Eigen::Vector3d& spacing_mm : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1.4, 1.4, 2)}) {
    const auto [gland, failed] = Breast(spacing_mm, 80).kept();
    EXPECT_GT(gland, 0.97) << spacing_mm.transpose();
    EXPECT_LT(failed, 0.1) << spacing_mm.transpose();
  }
}

TEST(BorderSharpness, WhereBothTouchEachIsJudgedByTheBordersBesideIt) {
  const auto [gland, failed] = Breast({1.4, 1.4, 2}, 68).kept();
  EXPECT_GT(gland, 0.8);
  EXPECT_LT(failed, 0.3);
}

TEST(BorderSharpness, FarFromAnyBorderNothingIsLeftOut) {
  Breast breast({2, 2, 2}, 80);
  breast.looks.assign(breast.grid.count(), 1);
  EXPECT_EQ(with_sharp_borders(breast.looks, breast.inner, breast.fat, breast.grid), breast.looks);
}

}  // namespace
}  // namespace supine::segmentation
