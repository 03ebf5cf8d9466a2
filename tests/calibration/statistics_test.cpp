// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace supine::calibration {

TEST(Statistics, PercentileIsLinearBetweenOrderStatistics) {
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 0.95), 3.85);
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 0), 1);
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 1), 4);
  EXPECT_DOUBLE_EQ(percentile({7}, 0.95), 7);
  EXPECT_TRUE(std::isnan(percentile({}, 0.5)));
}

TEST(Statistics, FiguresOfSignedDistancesByHand) {
  const DistanceFigures figures = figures_of({-3, 1, 1, 5});
  EXPECT_DOUBLE_EQ(figures.mae_mm, 2.5);
  EXPECT_DOUBLE_EQ(figures.rms_mm, 3);
  EXPECT_DOUBLE_EQ(figures.median_mm, 2);
  EXPECT_DOUBLE_EQ(figures.p95_mm, 4.7);
  EXPECT_DOUBLE_EQ(figures.hausdorff_mm, 5);
  EXPECT_DOUBLE_EQ(figures.mean_signed_mm, 1);
}

}  // namespace supine::calibration
