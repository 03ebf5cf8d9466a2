// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/plausibility.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "tests/calibration/shapes.h"

namespace supine::registration {
namespace {

/// A skin without symmetry, 140 mm wide; z is away from the chest.
double height(double x, double y) {
  const double dome = 45 * std::exp(-((x - 8) * (x - 8) / 2200 + (y + 5) * (y + 5) / 1400));
  return dome + 24 * std::exp(-((x + 35) * (x + 35) + (y - 30) * (y - 30)) / 300) + 0.002 * x * x;
}

double hanging(double x, double y) { return 2.6 * height(x, y); }

double round_dome(double x, double y) { return 45 * std::exp(-(x * x + y * y) / 1800); }

using Height = double (*)(double, double);
using Change = std::function<void(Points&)>;

struct Body {
  reconstruction::Surface surface;
  calibration::ModelSkin skin;
  explicit Body(Height shape) : surface(testing::sheet(-70, 70, 56, shape)), skin(surface.points, surface.triangles) {}
};

/// What is said of a scan of @p shape that was changed, beside a body as predicted and as imaged.
Readings readings(const Change& change, Height shape = height, Height predicted = height, Height imaged = hanging) {
  const Body supine(predicted), prone(imaged);
  reconstruction::Surface seen = testing::sheet(-55, 55, 44, shape);
  change(seen.points);
  const calibration::Scan scan(seen, supine.skin);
  return examine_readings(scan, {{"supine", &supine.skin, Points(supine.surface.points - prone.surface.points)},
                                 {"prone", &prone.skin, Points::Zero(prone.surface.points.rows(), 3)}});
}

std::string other_reading(const Change& change) {
  const Readings found = readings(change);
  return found.better ? found.better->words : "";
}

TEST(ScanReadings, AsItIsFitsAndItsSideIsKnown) {
  const Readings found = readings([](Points&) {});
  EXPECT_LT(found.given.misfit_mm, 0.3);
  EXPECT_FALSE(found.better);
  EXPECT_FALSE(found.side_unverified());
  EXPECT_FALSE(found.head_unverified());
  EXPECT_EQ(check_readings(found, "supine", false, "scan.ply"), "");
}

TEST(ScanReadings, AModelThatMovesTooFarOrAPlaceAFewMillimetresOffSpeakAgainstNoScan) {
  // Some of the way back to the imaged shape, 3 mm out of place: a model that is far too soft.
  const auto stiffer = [](double x, double y) { return height(x, y) + 0.15 * (hanging(x, y) - height(x, y)); };
  const Readings found = readings([](Points& p) { p.col(0).array() += 3; }, +stiffer);
  EXPECT_LT(found.given.misfit_mm, 2);
  EXPECT_FALSE(found.better);
}

TEST(ScanReadings, MirroredTurnedAndShiftedScansAreNamed) {
  EXPECT_EQ(other_reading([](Points& p) { p.col(0) *= -1; }), "mirrored (x negated: left for right)");
  EXPECT_EQ(other_reading([](Points& p) {
              p = p * Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ()).toRotationMatrix().transpose();
            }),
            "turned by -90° about z");
  EXPECT_EQ(other_reading([](Points& p) { p.col(1).array() += 25; }), "shifted by (0, -25, 0) mm");
}

TEST(ScanReadings, OtherUnitsAndSizesAreNamed) {
  EXPECT_EQ(other_reading([](Points& p) { p *= 0.1; }), "in cm");
  EXPECT_EQ(other_reading([](Points& p) { p /= 25.4; }), "in inches");
  const Readings found = readings([](Points& p) { p *= 1.25; });
  ASSERT_TRUE(found.better);
  EXPECT_NE(found.better->words.find("times as large"), std::string::npos) << found.better->words;
}

TEST(ScanReadings, AScanOfAnotherPoseIsNamed) {
  const Readings found = readings([](Points&) {}, hanging);
  ASSERT_TRUE(found.better);
  EXPECT_EQ(found.better->words, "as a scan of the prone pose");
  try {
    check_readings(found, "supine", true, "scan.ply");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("scan.ply: does not fit the supine shape as given"), std::string::npos);
  }
}

TEST(ScanReadings, AScanThatFitsInNoReadingIsRefused) {
  Readings none{{"as given", 9.9, 0.2}, {}, {}, {}};
  EXPECT_THROW(check_readings(none, "supine", true, "scan.ply"), InputError);
  none.given.misfit_mm = 5;
  EXPECT_NO_THROW(check_readings(none, "supine", true, "scan.ply"));
  none.upended = Reading{"mirrored (z negated: head for feet)", 5.2, 0.2};
  EXPECT_NE(check_readings(none, "supine", false, "scan.ply").find("the upper end of the supine scan is not verified"),
            std::string::npos);
  EXPECT_EQ(check_readings(none, "supine", true, "scan.ply"), "") << "landmarks say which end is up";
}

TEST(ScanReadings, AScanThatNeverMeetsTheSkinIsRefused) {
  Readings none{{"as given", std::numeric_limits<double>::infinity(), 0}, {}, {}, {}};
  try {
    check_readings(none, "supine", true, "scan.ply");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("scan.ply: too few of its points"), std::string::npos) << error.what();
  }
}

TEST(ScanReadings, WhereASymmetricBodyDoesNotTellItsSideThatIsSaid) {
  const auto hanging_dome = [](double x, double y) { return 1.7 * round_dome(x, y); };
  const Readings found = readings([](Points& p) { p.col(0) *= -1; }, round_dome, round_dome, +hanging_dome);
  EXPECT_FALSE(found.better);
  EXPECT_NE(check_readings(found, "supine", false, "scan.ply").find("side of the supine scan is not verified"),
            std::string::npos);
  EXPECT_EQ(check_readings(found, "supine", true, "scan.ply"), "") << "landmarks say which side it is";
}

}  // namespace
}  // namespace supine::registration
