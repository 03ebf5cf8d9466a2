// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/error_sources.h"

#include <gtest/gtest.h>

#include "tests/diagnosis/sheet.h"

namespace supine::diagnosis {
namespace {

/// One row per effect, slope 1, 2, 3, … everywhere.
std::vector<Candidate> candidates_of(Eigen::Index points) {
  std::vector<Candidate> list;
  for (const char* name :
       {"misregistration", "segmentation_offset", "chest_wall_motion", "incompressibility", "adhesion"})
    list.push_back({name,
                    {{std::string(name) + ".p", "mm", 0, -2, 2, 0.5, false}},
                    Eigen::MatrixXd::Constant(points, 1, static_cast<double>(list.size() + 1))});
  return list;
}

TEST(ErrorSources, AModeIsTheToleranceTimesTheSlopeAndTissueEffectsHaveNone) {
  const auto r = supine::testing::sheet(1);
  const ErrorSources sources = error_sources(r, candidates_of(r.size()), nullptr, {0.7, 0, 1});
  ASSERT_EQ(sources.modes.size(), 4u);
  const double expected[] = {0.3 * 1, 0.3 * 2, 1.0 * 3, 0.1 * 4};
  for (std::size_t m = 0; m < 4; ++m) EXPECT_DOUBLE_EQ(sources.modes[m].shape_mm[0], expected[m]) << m;
  EXPECT_EQ(tolerance_for("adhesion", "1", {}), 0);
  EXPECT_EQ(tolerance_for("misregistration", "rad", {}), Tolerances{}.registration_rad);
}

TEST(ErrorSources, EveryScanLiesElsewhereAndBreathesInItsOwnWay) {
  auto r = supine::testing::sheet(3);
  const Eigen::Index half = r.size() / 2;
  r.pose.tail(r.size() - half).setOnes();
  const ErrorSources sources = error_sources(r, candidates_of(r.size()), nullptr, {0.7, 0, 1});
  ASSERT_EQ(sources.modes.size(), 6u);
  const char* source[] = {"registration", "registration", "segmentation", "chest_wall", "chest_wall", "numerical"};
  for (std::size_t m = 0; m < 6; ++m) EXPECT_EQ(sources.modes[m].source, source[m]) << m;
  for (const std::size_t m : {0u, 3u}) {
    EXPECT_TRUE(sources.modes[m].shape_mm.tail(r.size() - half).isZero(0));
    EXPECT_TRUE(sources.modes[m + 1].shape_mm.head(half).isZero(0));
    EXPECT_TRUE((sources.modes[m].shape_mm.head(half).array() > 0).all());
  }
}

TEST(ErrorSources, WithoutToleranceTakesTheEffectsOwnModeOnly) {
  const auto r = supine::testing::sheet(2);
  const ErrorSources sources = error_sources(r, candidates_of(r.size()), nullptr, {0.7, 0, 1});
  const ErrorSources rest = without_tolerance_for("chest_wall_motion", sources);
  ASSERT_EQ(rest.modes.size(), 3u);
  for (const ErrorMode& mode : rest.modes) EXPECT_NE(mode.source, "chest_wall");
  EXPECT_EQ(without_tolerance_for("adhesion", sources).modes.size(), 4u);
}

TEST(ErrorSources, APlaceIsNotToleratedAndWhatEachScanErrsByItselfAveragesOut) {
  const Tolerances t;
  EXPECT_EQ(tolerance_for("chest_wall_motion", "mm", t), t.chest_wall_mm);
  EXPECT_EQ(tolerance_for("chest_wall_motion", "1", t), 0);
  EXPECT_DOUBLE_EQ(shared_tolerance_for("chest_wall_motion", "mm", t, 4), 0.5 * t.chest_wall_mm);
  EXPECT_EQ(shared_tolerance_for("segmentation_offset", "mm", t, 4), t.segmentation_mm) << "one image for all scans";
}

}  // namespace
}  // namespace supine::diagnosis
