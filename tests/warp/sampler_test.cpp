// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/sampler.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/warp/two_shapes.h"

namespace supine::warp {
namespace {

double wave(const Eigen::Vector3d& p) {
  return std::sin(0.21 * p.x()) * std::cos(0.17 * p.y()) + 0.3 * std::sin(0.2 * p.z());
}

const segmentation::Grid grid = testing::grid_over({0, 0, 0}, 40, 2);

TEST(Sampler, EveryKindGivesTheVoxelsThemselves) {
  const auto volume = testing::volume_of(grid, wave);
  for (const auto kind : {Interpolation::nearest, Interpolation::linear, Interpolation::bspline}) {
    const Sampler sampler(volume, kind);
    for (int i = 0; i < 20; ++i)
      EXPECT_NEAR(*sampler.at(Eigen::Vector3d(i, 20 - i, i / 2)), volume.at(i, 20 - i, i / 2), 1e-5);
  }
}

TEST(Sampler, SplinesAreOfFourthOrderLinesOfSecond) {
  const auto error = [](Interpolation kind, double spacing) {
    const auto volume = testing::volume_of(testing::grid_over({0, 0, 0}, 48, spacing), wave);
    const Sampler sampler(volume, kind);
    double most = 0;
    // Away from the ends, where the spline is mirrored and the wave is not.
    for (double x = 16; x < 32; x += 1.37) {
      const Eigen::Vector3d index = Eigen::Vector3d(x, 48 - x, 0.5 * x + 9) / spacing;
      most = std::max(most, std::abs(*sampler.at(index) - wave(volume.grid.point(index))));
    }
    return most;
  };
  EXPECT_GT(error(Interpolation::linear, 4) / error(Interpolation::linear, 2), 2.8);
  EXPECT_GT(error(Interpolation::bspline, 4) / error(Interpolation::bspline, 2), 10);
}

TEST(Sampler, GivesNothingBeyondHalfAVoxel) {
  const auto volume = testing::volume_of(grid, wave);
  const Sampler sampler(volume, Interpolation::linear);
  EXPECT_TRUE(sampler.at({-0.49, 0, 0}));
  EXPECT_FALSE(sampler.at({-0.51, 0, 0}));
  EXPECT_FALSE(sampler.at({0, 20.51, 0}));
}

}  // namespace
}  // namespace supine::warp
