// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/creases.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "calibration/model_skin.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;
using supine::testing::twin_truth;

/// Two triangles of an uneven quadrilateral.
const Points corners = (Points(4, 3) << 0, 0, 0, 7, 1, 0.5, 6, 9, -1, -2, 5, 2).finished();
const Triangles two = (Triangles(2, 3) << 0, 1, 2, 0, 2, 3).finished();

/// Stretched along an oblique direction and turned as a whole.
Points stretched(double along, double across) {
  const Eigen::Vector3d a = Eigen::Vector3d(1, 2, 0).normalized(), c = Eigen::Vector3d::UnitZ(), b = c.cross(a);
  const Eigen::Matrix3d stretch = along * a * a.transpose() + across * b * b.transpose() + c * c.transpose();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  Points flat = corners;
  flat.col(2).setZero();
  return flat * (turn * stretch).transpose();
}

TEST(Creases, AreWhereSkinIsThickerByTheBoundThanItIsShortest) {
  Points flat = corners;
  flat.col(2).setZero();
  // (1 · 0.7²)⁻¹ = 2.04, (1 · 0.72²)⁻¹ = 1.93; beside a stretch of 1.2 already at 0.64, under one of 0.8 at 0.79.
  EXPECT_TRUE(creased(two, flat, stretched(0.70, 1)).all());
  EXPECT_FALSE(creased(two, flat, stretched(0.72, 1)).any());
  EXPECT_TRUE(creased(two, flat, stretched(1, 0.70)).all());
  EXPECT_FALSE(creased(two, flat, stretched(0.66, 1.2)).any());
  EXPECT_TRUE(creased(two, flat, stretched(0.63, 1.2)).all());
  EXPECT_TRUE(creased(two, flat, stretched(0.78, 0.8)).all());
  EXPECT_FALSE(creased(two, corners, corners).any());
}

TEST(Creases, AreNotOnASmoothBreast) {
  const Twin twin({twin_truth(), 0.3});
  calibration::Evaluator evaluator(twin.scene(), twin_truth());
  const calibration::Prediction prediction = evaluator.predict(twin_truth());
  const auto residuals =
      calibration::residuals_of(twin.scene(), prediction, calibration::points_over_skin(prediction), {0.3});
  const CreaseError error = crease_error(twin.scene(), prediction, residuals);
  EXPECT_EQ(error.points, 0);
  EXPECT_EQ(error.sd_mm.norm(), 0);
}

/// The skin beyond a plane was twice as long: it is pressed together as if it had folded.
TEST(Creases, ErrByAThirdOfAnEdgeOverThemAndAnEdgeAround) {
  const Twin twin({twin_truth(), 0.3});
  calibration::Evaluator evaluator(twin.scene(), twin_truth());
  calibration::Prediction prediction = evaluator.predict(twin_truth());
  const auto residuals =
      calibration::residuals_of(twin.scene(), prediction, calibration::points_over_skin(prediction), {0.3});
  const Points& x = prediction.solution.poses[0].x;
  const double plane = x.col(0).mean();
  Points& X = prediction.solution.X = x;
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    if (X(i, 0) > plane) X(i, 0) += X(i, 0) - plane;
  const CreaseError error = crease_error(twin.scene(), prediction, residuals);
  const Triangles triangles = calibration::ModelSkin(twin.mesh, X).triangles();
  double edge_mm = 0;  // all but its border lies in two triangles
  for (const Eigen::RowVector3i& t : triangles.rowwise())
    for (int k = 0; k < 3; ++k)
      edge_mm += (X.row(t[k]) - X.row(t[(k + 1) % 3])).norm() / static_cast<double>(3 * triangles.rows());
  EXPECT_NEAR(error.length_mm, 2 * edge_mm, 0.04 * edge_mm);
  Eigen::Index over = 0;
  for (Eigen::Index r = 0; r < residuals.size(); ++r) {
    over += error.sd_mm[r] > 0;
    if (residuals.on_skin(r, 0) < plane - 3 * edge_mm) {
      EXPECT_EQ(error.sd_mm[r], 0) << "far from what is pressed together";
    }
    if (error.sd_mm[r] > 0) {
      EXPECT_NEAR(error.sd_mm[r], error.length_mm / 6, 1e-12);
    }
  }
  EXPECT_EQ(over, error.points);
  EXPECT_GT(over, residuals.size() / 5);
}

}  // namespace
}  // namespace supine::diagnosis
