// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/expected_landmarks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"

namespace supine::calibration {
namespace {

/// Two landmarks whose errors go together along x.
ExpectedPlaces expected() {
  ExpectedPlaces places{{"nipple", "upper"}, Points(2, 3), Eigen::MatrixXd::Identity(6, 6)};
  places.places << 1, 2, 3, 10, 20, 30;
  places.covariance(0, 0) = places.covariance(3, 3) = 4;
  places.covariance(0, 3) = places.covariance(3, 0) = 3;
  return places;
}

Landmarks measured(const Eigen::RowVector3d& nipple, const Eigen::RowVector3d& upper) {
  Landmarks marks{{"upper", "nipple"}, Points(2, 3)};
  marks.points << upper, nipple;
  return marks;
}

TEST(ExpectedLandmarks, CountWhatGoesTogetherOnce) {
  const auto same = compare_to_expected(measured({3, 2, 3}, {12, 20, 30}), expected());
  EXPECT_EQ(same.degrees, 6);
  EXPECT_NEAR(same.off_mm[0], 2, 1e-12);
  EXPECT_NEAR(same.expected_mm[0], std::sqrt(6.0), 1e-12);
  EXPECT_NEAR(same.chi_squared, 8 / 7.0, 1e-12) << "(2, 2) under [[4, 3], [3, 4]]";
  const auto apart = compare_to_expected(measured({3, 2, 3}, {8, 20, 30}), expected());
  EXPECT_NEAR(apart.chi_squared, 8, 1e-12) << "(2, -2) is seven times as far";
  EXPECT_LT(apart.p_value, same.p_value);
  EXPECT_NEAR(apart.p_value, std::exp(-4.0) * (1 + 4 + 8), 1e-12) << "chi squared of six degrees in closed form";
}

TEST(ExpectedLandmarks, OneOfThemIsHeldAgainstItsOwnBlock) {
  Landmarks one{{"upper"}, Points(1, 3)};
  one.points << 12, 20, 30;
  const auto found = compare_to_expected(one, expected());
  EXPECT_EQ(found.degrees, 3);
  EXPECT_NEAR(found.chi_squared, 1, 1e-12);
}

TEST(ExpectedLandmarks, AreRefusedWhereNothingIsExpectedOrTheCovarianceIsNone) {
  Landmarks other{{"lower"}, Points::Zero(1, 3)};
  try {
    compare_to_expected(other, expected());
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("lower"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("nipple, upper"), std::string::npos);
  }
  ExpectedPlaces broken = expected();
  broken.covariance(0, 3) = broken.covariance(3, 0) = 5;
  EXPECT_THROW(compare_to_expected(measured({3, 2, 3}, {8, 20, 30}), broken), InputError);
}

}  // namespace
}  // namespace supine::calibration
