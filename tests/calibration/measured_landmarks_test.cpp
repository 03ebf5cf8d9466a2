// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/measured_landmarks.h"

#include <gtest/gtest.h>

#include "common/error.h"

namespace supine::calibration {
namespace {

Landmarks imaged() {
  Landmarks marks{{"left", "nipple", "right"}, Points(3, 3)};
  marks.points << 40, -30, 0, 0, -60, 5, -40, -30, 0;
  return marks;
}

Landmarks measured() {
  Landmarks marks{{"nipple", "left", "right"}, Points(3, 3)};
  marks.points << 10, -45, 0, 48, -25, 1, -33, -25, 2;
  return marks;
}

MeasuredLandmarks pairs() { return pair_landmarks(imaged(), measured()); }

std::string refusal(const MeasuredLandmarks& landmarks, const Points& predicted) {
  try {
    check_landmarks(landmarks, predicted);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(MeasuredLandmarks, GoTogetherByName) {
  const MeasuredLandmarks found = pairs();
  EXPECT_EQ(found.names, measured().names);
  EXPECT_EQ(found.imaged.row(0), imaged().points.row(1));
  EXPECT_EQ(found.imaged.row(1), imaged().points.row(0));
  EXPECT_EQ(found.measured, measured().points);
  Landmarks unknown = measured();
  unknown.names[2] = "rigth";
  EXPECT_THROW(pair_landmarks(imaged(), unknown), InputError);
}

TEST(MeasuredLandmarks, AddTheVariancesThatTheirFilesState) {
  EXPECT_EQ(pairs().sigma_mm, Eigen::VectorXd::Constant(3, 1.5)) << "neither states one";
  Landmarks body = imaged(), scan = measured();
  scan.sigma_mm = Eigen::Vector3d(4, 2, 1);
  EXPECT_EQ(pair_landmarks(body, scan).sigma_mm, scan.sigma_mm);
  body.sigma_mm = Eigen::Vector3d(0.5, 3, 2);
  EXPECT_DOUBLE_EQ(pair_landmarks(body, scan).sigma_mm[0], 5) << "nipple: 3 in the image, 4 in the scan";
}

TEST(MeasuredLandmarks, MayLieOffByWhatAModelMayBeWrongBy) {
  EXPECT_EQ(refusal(pairs(), measured().points), "");
  EXPECT_EQ(refusal(pairs(), measured().points.rowwise() + Eigen::RowVector3d(0, 40, 0)), "");
}

TEST(MeasuredLandmarks, AreRefusedWhereTheyCannotBe) {
  MeasuredLandmarks landmarks = pairs();
  landmarks.measured.row(2) += Eigen::RowVector3d(0, 0, 70);
  const std::string far = refusal(landmarks, measured().points);
  EXPECT_NE(far.find("'right'"), std::string::npos) << far;
  EXPECT_NE(far.find("70 mm"), std::string::npos) << far;
  EXPECT_NE(far.find("bound 60 mm"), std::string::npos) << far;
}

TEST(MeasuredLandmarks, TellWhatElseTheFileMayBe) {
  const Points there = measured().points.rowwise() + Eigen::RowVector3d(0, -80, 0);
  MeasuredLandmarks landmarks = pairs();
  landmarks.measured = 0.001 * there;
  EXPECT_NE(refusal(landmarks, there).find("spread"), std::string::npos);
  EXPECT_NE(refusal(landmarks, there).find("metres"), std::string::npos);
  landmarks.measured = there;
  landmarks.measured.leftCols<2>() *= -1;
  EXPECT_NE(refusal(landmarks, there).find("RAS"), std::string::npos);
}

TEST(MeasuredLandmarks, AreRefusedWhereTwoHaveChangedNames) {
  MeasuredLandmarks landmarks = pairs();
  const Points& predicted = measured().points;
  landmarks.measured = predicted;
  landmarks.measured.row(1).swap(landmarks.measured.row(2));
  const std::string exchanged = refusal(landmarks, predicted);
  EXPECT_NE(exchanged.find("'left' and 'right'"), std::string::npos) << exchanged;
  EXPECT_NE(exchanged.find("exchanged"), std::string::npos) << exchanged;
}

TEST(MeasuredLandmarks, ADoubtIsToldWhereAFactorExplainsWhatIsOff) {
  const Points there = measured().points;
  const Eigen::RowVector3d middle = there.colwise().mean(), moved = middle + Eigen::RowVector3d(3, 4, 0);
  const auto spread_by = [&](double factor) {
    MeasuredLandmarks landmarks = pairs();
    landmarks.measured = (factor * (there.rowwise() - middle)).rowwise() + moved;
    return landmarks;
  };
  EXPECT_EQ(doubt_of_scale(spread_by(1), there), "");
  EXPECT_EQ(doubt_of_scale(spread_by(1.1), there), "");
  EXPECT_NE(doubt_of_scale(spread_by(1.3), there).find("3 landmarks are spread 1.30 times"), std::string::npos);
  EXPECT_NE(doubt_of_scale(spread_by(0.75), there).find("spread 0.75 times"), std::string::npos);
  EXPECT_NE(doubt_of_scale(spread_by(1.3), there).find(" 0.0 mm without"), std::string::npos);
  MeasuredLandmarks scattered = spread_by(1.3);  // a factor explains most of it, not all
  scattered.measured.col(2) += Eigen::Vector3d(3, -3, 0);
  EXPECT_NE(doubt_of_scale(scattered, there).find("check their unit"), std::string::npos);
  MeasuredLandmarks vague = spread_by(1.3);
  vague.sigma_mm.setConstant(20);
  EXPECT_EQ(doubt_of_scale(vague, there), "") << "within what the file says of its errors";
  MeasuredLandmarks otherwise = spread_by(1.3);
  otherwise.measured.col(1) += Eigen::Vector3d(40, -40, 0);
  EXPECT_EQ(doubt_of_scale(otherwise, there), "") << "no factor explains that";
}

}  // namespace
}  // namespace supine::calibration
