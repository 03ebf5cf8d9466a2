// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/patient_frame.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace supine::pipeline {
namespace {

TEST(PatientFrame, LettersAreTheSidesToWhichTheAxesGrow) {
  EXPECT_EQ(*axes_of_frame("LPS"), Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
  EXPECT_EQ(*axes_of_frame("RAS"), Eigen::Matrix3d(Eigen::Vector3d(-1, -1, 1).asDiagonal()));
  // x to the front is -y in LPS, y to the left is x, z to the head stays.
  EXPECT_EQ(*axes_of_frame("ALS") * Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(2, -1, 3));
}

TEST(PatientFrame, ThereAre48AndNoOthers) {
  const std::string letters = "LRAPSIHx";
  int frames = 0, turned = 0;
  for (const char a : letters)
    for (const char b : letters)
      for (const char c : letters)
        if (const auto axes = axes_of_frame({a, b, c})) {
          ++frames;
          turned += axes->determinant() > 0;
        }
  EXPECT_EQ(frames, 48);
  EXPECT_EQ(turned, 24);  // the other half are mirrored, which is how some files are
  for (const char* none : {"", "LP", "LPSS", "lps"}) EXPECT_FALSE(axes_of_frame(none)) << none;
}

TEST(PatientFrame, VoxelsLieInLpsWhereTheFrameSaysTheyDo) {
  segmentation::Grid grid;
  grid.size = {4, 5, 6};
  grid.spacing_mm = {1, 2, 3};
  grid.origin_mm = {10, 20, 30};
  const Eigen::Matrix3d axes = *axes_of_frame("ALS");
  const segmentation::Grid turned = in_lps(grid, axes);
  const Eigen::Vector3d index(3, 1, 2);
  EXPECT_LT((turned.point(index) - axes * grid.point(index)).norm(), 1e-12);
  EXPECT_LT((turned.continuous_index(turned.point(index)) - index).norm(), 1e-12);
}

}  // namespace
}  // namespace supine::pipeline
