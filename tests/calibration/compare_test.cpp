// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/error.h"
#include "tests/calibration/shapes.h"

namespace supine::calibration {
namespace {

// Model: the plane z = 0 over [0, 40]², 5 × 5 points, "left" where x < 20, "right" elsewhere.
struct Plate {
  reconstruction::Surface surface = testing::sheet(0, 40, 4);
  SkinAreas areas{{"left", "right", "nowhere"}, Eigen::VectorXi::Zero(25)};

  Plate() {
    for (int i = 0; i < 25; ++i) areas.of_point[i] = surface.points(i, 0) < 20 ? 0 : 1;
  }
  ModelSkin skin() const { return {surface.points, surface.triangles}; }
};

// Seven columns, each within a third of a square of a column of the model, so that its area is beyond doubt:
// four on the left at z = -1, three on the right at z = 3; seven rows.
reconstruction::Surface step() {
  constexpr double columns[7] = {2, 9, 11, 12, 22, 29, 31};
  auto surface = testing::sheet(5, 35, 6);
  for (int i = 0; i < 49; ++i) {
    surface.points(i, 0) = columns[i % 7];
    surface.points(i, 2) = i % 7 < 4 ? -1 : 3;
  }
  return surface;
}

}  // namespace

TEST(Compare, FlatScanBelowTheModelByHand) {
  const Plate plate;
  const ModelSkin model = plate.skin();
  const Scan scan(testing::sheet(5, 35, 6, [](double, double) { return -2.0; }), model);
  const Comparison result = compare(model, scan, plate.areas);
  EXPECT_NEAR(result.mae_study_mm, 2, 1e-13);
  EXPECT_NEAR(result.covered_fraction, 9.0 / 16, 1e-15);  // the inner points: each a square of area
  EXPECT_EQ(result.scan_points_used, 49);
  EXPECT_NEAR(result.scan.mae_mm, 2, 1e-13);
  EXPECT_NEAR(result.scan.rms_mm, 2, 1e-13);
  EXPECT_NEAR(result.scan.mean_signed_mm, -2, 1e-13);
  EXPECT_NEAR(result.scan.hausdorff_mm, 2, 1e-13);
  EXPECT_NEAR(result.model_to_scan.to_scan.distance_mm[12], -2, 1e-13);
}

TEST(Compare, AContourSaysHowFarOffItsPointsAreAndCoversNothing) {
  const Plate plate;
  const ModelSkin model = plate.skin();
  const Scan scan({testing::contour(5, 35, [](double, double) { return -2.0; }), Triangles(0, 3), {}}, model);
  const Comparison result = compare(model, scan, plate.areas);
  EXPECT_EQ(result.scan_points_used, scan.points().rows());
  EXPECT_NEAR(result.scan.rms_mm, 2, 1e-12);
  EXPECT_NEAR(result.scan.mean_signed_mm, -2, 1e-12);
  EXPECT_EQ(result.model_to_scan.covered.count(), 0);
  EXPECT_TRUE(std::isnan(result.covered_fraction));
  EXPECT_TRUE(std::isnan(result.mae_study_mm));
  EXPECT_EQ(result.areas.at(0).scan_points + result.areas.at(1).scan_points, scan.points().rows());
}

TEST(Compare, ASpikeIsNamedAndCountsInAllFiguresButOne) {
  const reconstruction::Surface plate = testing::sheet(0, 40, 4);
  const ModelSkin model(plate.points, plate.triangles);
  reconstruction::Surface surface =
      testing::sheet(3, 37, 14, [](double x, double y) { return 0.3 * std::sin(3 * x + 5 * y); });
  const Scan clean(surface, model);
  EXPECT_TRUE(compare(model, clean, {}).outliers.points.empty());
  surface.points(112, 2) = 9;  // in the middle
  const Comparison result = compare(model, Scan(surface, model), {});
  EXPECT_EQ(result.outliers.points, std::vector<int>{112});
  EXPECT_EQ(result.outliers.over_skin, result.scan_points_used);
  const double n = result.scan_points_used;
  EXPECT_NEAR(n * std::pow(result.scan.rms_mm, 2) - 81, (n - 1) * std::pow(result.rms_kept_mm, 2), 1e-9);
  EXPECT_TRUE(compare(model, Scan(surface, model), {}, {}, 5).outliers.points.empty()) << "held against noise of 5 mm";
}

TEST(Compare, StudyErrorAverageIsOverCoveredPointsOnly) {
  const Plate plate;
  const ModelSkin model = plate.skin();
  // Slope 0.2 along x: the foot of (x, y, 0) lies at distance (1 + 0.2 x) / √1.04.
  const Scan scan(testing::sheet(5, 35, 6, [](double x, double) { return 1 + 0.2 * x; }), model);
  const Comparison result = compare(model, scan, plate.areas);
  double sum = 0;
  int covered = 0;
  for (int i = 0; i < 25; ++i) {
    const double x = plate.surface.points(i, 0), y = plate.surface.points(i, 1);
    const double foot = x - 0.2 * (1 + 0.2 * x) / 1.04;
    if (foot <= 5 || foot >= 35 || y <= 5 || y >= 35) continue;
    sum += (1 + 0.2 * x) / std::sqrt(1.04);
    ++covered;
  }
  EXPECT_NEAR(result.covered_fraction, covered / 16.0, 1e-15);
  EXPECT_NEAR(result.mae_study_mm, sum / covered, 1e-12);
}

TEST(Compare, ScanFiguresAndAreasOfAStepByHand) {
  const Plate plate;
  const ModelSkin model = plate.skin();
  const Scan scan(step(), model);
  const Comparison result = compare(model, scan, plate.areas);
  EXPECT_NEAR(result.scan.mae_mm, (4 * 1 + 3 * 3) / 7.0, 1e-13);
  EXPECT_NEAR(result.scan.rms_mm, std::sqrt((4 * 1 + 3 * 9) / 7.0), 1e-13);
  EXPECT_NEAR(result.scan.mean_signed_mm, (-4 + 9) / 7.0, 1e-13);
  EXPECT_NEAR(result.scan.median_mm, 1, 1e-13);
  EXPECT_NEAR(result.scan.p95_mm, 3, 1e-13);
  EXPECT_NEAR(result.scan.hausdorff_mm, 3, 1e-13);
  ASSERT_EQ(result.areas.size(), 2u);  // "nowhere" has no skin
  EXPECT_EQ(result.areas[0].name, "left");
  EXPECT_NEAR(result.areas[0].area_cm2 + result.areas[1].area_cm2, 16, 1e-12);
  EXPECT_NEAR(result.areas[0].area_cm2, 6, 1e-12);  // of four columns of squares: one, and half the next
  EXPECT_NEAR(result.areas[0].mean_signed_mm, -1, 1e-13);
  EXPECT_NEAR(result.areas[1].mae_mm, 3, 1e-13);
  EXPECT_EQ(result.areas[0].scan_points, 28);
  EXPECT_EQ(result.areas[1].scan_points, 21);
}

TEST(Compare, ScanBeyondTheModelIsCountedAndLeftOut) {
  const Plate plate;
  const ModelSkin model = plate.skin();
  const Scan scan(testing::sheet(-10, 50, 12, [](double, double) { return 2.0; }), model);
  const Comparison result = compare(model, scan, {});
  EXPECT_EQ(scan.points().rows(), 169);
  EXPECT_EQ(result.scan_points_used, 49);
  EXPECT_NEAR(result.scan.hausdorff_mm, 2, 1e-13);
  EXPECT_NEAR(result.covered_fraction, 1, 1e-15);
  EXPECT_TRUE(result.areas.empty());
}

TEST(Compare, AreaWithoutScanPointsHasNoError) {
  const Plate plate;
  const ModelSkin model = plate.skin();
  const Scan scan(testing::sheet(22, 38, 6), model);
  const Comparison result = compare(model, scan, plate.areas);
  EXPECT_EQ(result.areas[0].scan_points, 0);
  EXPECT_TRUE(std::isnan(result.areas[0].mae_mm));
}

TEST(Compare, RotationShiftAndOrderOfPointsDoNotMatter) {
  const auto bump = [](double x, double y) { return 1.5 * std::sin(x / 7) * std::cos(y / 9) + 0.5; };
  const Plate plate;
  const auto scan_surface = testing::sheet(3, 37, 17, bump);
  const ModelSkin model = plate.skin();
  const Comparison straight = compare(model, Scan(scan_surface, model), plate.areas);

  const Eigen::Matrix3d rotation = testing::some_rotation();
  const auto move = [&](const Points& points) -> Points {
    return (points * rotation.transpose()).rowwise() + Eigen::RowVector3d(30, -20, 11);
  };
  const ModelSkin moved_model(move(plate.surface.points), plate.surface.triangles);
  const auto count = static_cast<int>(scan_surface.points.rows());
  reconstruction::Surface backward{move(scan_surface.points).colwise().reverse(),
                                   (count - 1 - scan_surface.triangles.array()).colwise().reverse(),
                                   {}};
  const Comparison moved = compare(moved_model, Scan(backward, moved_model), plate.areas);
  EXPECT_NEAR(moved.mae_study_mm, straight.mae_study_mm, 1e-12);
  EXPECT_NEAR(moved.scan.rms_mm, straight.scan.rms_mm, 1e-12);
  EXPECT_NEAR(moved.scan.p95_mm, straight.scan.p95_mm, 1e-12);
  EXPECT_NEAR(moved.scan.mean_signed_mm, straight.scan.mean_signed_mm, 1e-12);
  EXPECT_NEAR(moved.covered_fraction, straight.covered_fraction, 1e-14);
  EXPECT_EQ(moved.scan_points_used, straight.scan_points_used);
  EXPECT_NEAR(moved.areas[1].mae_mm, straight.areas[1].mae_mm, 1e-12);
}

TEST(Compare, ScanBesideTheModelIsRefused) {
  const Plate plate;
  const ModelSkin model = plate.skin();
  const Scan scan(testing::sheet(45, 60, 6), model);
  EXPECT_THROW(compare(model, scan, plate.areas), InputError);
}

TEST(Compare, SkinPointWithoutAreaIsRefused) {
  Plate plate;
  plate.areas.of_point[7] = -1;
  const ModelSkin model = plate.skin();
  EXPECT_THROW(compare(model, Scan(testing::sheet(5, 35, 6), model), plate.areas), InputError);
}

TEST(CompareLandmarks, DistancesInTheOrderMeasured) {
  Landmarks predicted{{"nipple", "upper", "mole"}, Points(3, 3)}, measured{{"upper", "nipple"}, Points(2, 3)};
  predicted.points << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  measured.points << 4, 5, 8, 1, 6, 6;
  const auto errors = compare_landmarks(predicted, measured);
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_EQ(errors[0].name, "upper");
  EXPECT_DOUBLE_EQ(errors[0].error_mm, 2);
  EXPECT_DOUBLE_EQ(errors[1].error_mm, 5);
}

TEST(CompareLandmarks, UnknownNameIsRefusedAndNamed) {
  const Landmarks predicted{{"nipple", "upper"}, Points::Zero(2, 3)}, measured{{"niple"}, Points::Zero(1, 3)};
  try {
    compare_landmarks(predicted, measured);
    FAIL() << "not refused";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("niple"), std::string::npos);
    EXPECT_NE(text.find("nipple, upper"), std::string::npos);
  }
}

}  // namespace supine::calibration
