// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/distance_figures.h"

#include <gtest/gtest.h>

namespace supine::calibration {

TEST(DistanceFigures, FiguresOfSignedDistancesByHand) {
  const DistanceFigures figures = figures_of({-3, 1, 1, 5});
  EXPECT_DOUBLE_EQ(figures.mae_mm, 2.5);
  EXPECT_DOUBLE_EQ(figures.rms_mm, 3);
  EXPECT_DOUBLE_EQ(figures.median_mm, 2);
  EXPECT_DOUBLE_EQ(figures.p95_mm, 4.7);
  EXPECT_DOUBLE_EQ(figures.hausdorff_mm, 5);
  EXPECT_DOUBLE_EQ(figures.mean_signed_mm, 1);
}

}  // namespace supine::calibration
