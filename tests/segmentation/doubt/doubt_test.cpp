// SPDX-License-Identifier: AGPL-3.0-or-later
// Made series of a drawn torso through the automatic recipes: what is found, and what is refused or doubted.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "phantom/mri/series.h"
#include "segmentation/steps/recipe_toml.h"
#include "segmentation/steps/run_recipe.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using phantom::MadeSeries;
using phantom::Series;
using phantom::Torso;

constexpr std::uint64_t seed = 3;

MadeSeries made(const Torso& torso, Series series, double voxel_mm = 2.2) {
  return phantom::make_series(torso, seed, {.series = series, .voxel_mm = {voxel_mm, voxel_mm, 4}});
}

/// Dice of the breast and of its gland, between the folds and in front of where a reader ends it.
std::pair<double, double> dice_of(const Torso& torso, const MadeSeries& series, const LabelImage& labels) {
  double both[2] = {}, sum[2] = {};
  const Grid& grid = labels.grid;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k));
        if (p.z() < torso.low_z_mm() || p.z() > torso.high_z_mm() || p.y() > torso.back_y_mm() - 10) continue;
        const auto stuff = static_cast<phantom::Stuff>(series.truth.at(i, j, k));
        const auto tissue = static_cast<Tissue>(labels.at(i, j, k));
        const bool truth[2] = {stuff == phantom::Stuff::fat || stuff == phantom::Stuff::gland ||
                                   stuff == phantom::Stuff::skin || stuff == phantom::Stuff::vessel,
                               stuff == phantom::Stuff::gland},
                   found[2] = {is_meshed(tissue), tissue == Tissue::gland};
        for (const int n : {0, 1}) {
          both[n] += truth[n] && found[n];
          sum[n] += truth[n] + found[n];
        }
      }
  return {2 * both[0] / sum[0], 2 * both[1] / sum[1]};
}

/// Mean grey over the front of the pectoral muscles, by the distance in front of it (mm, -8 to 8).
std::vector<double> across_the_muscle(const Torso& torso, const GreyImage& image) {
  std::vector<double> sum(17, 0);
  for (const int side : {0, 1})
    for (double x = 30; x <= 70; x += 0.5)
      for (double z = -20; z <= 20; z += 4)
        for (int n = 0; n < 17; ++n) {
          const double across = side == 0 ? -x : x;
          const Eigen::Vector3d p(across, torso.chest_y_mm(across, z) - (n - 8), z);
          const Eigen::Vector3i at = image.grid.continuous_index(p).array().round().cast<int>();
          sum[n] += image.at(at.x(), at.y(), at.z());
        }
  return sum;
}

/// Grey on the front of the muscle over the darker of what lies 6 mm to either side.
double line_of(const Torso& torso, const phantom::SeriesOptions& options) {
  const auto grey = across_the_muscle(torso, phantom::make_series(torso, seed, options).image);
  return grey[8] / std::min(grey[2], grey[14]);
}

TEST(MadeSeries, OutOfPhaseADarkLineRunsAlongTheMuscleAndInPhaseAFaintOne) {
  const Torso torso(seed);
  phantom::SeriesOptions options{.series = Series::fatsat, .voxel_mm = {1.8, 1.8, 4}};
  options.fat_phase_rad = 0;
  const double in_phase = line_of(torso, options);
  options.fat_phase_rad = std::numbers::pi;
  const double opposed = line_of(torso, options);
  EXPECT_GT(in_phase, 0.95);  // without fascia the mean of muscle and fat, 1.08 of muscle
  EXPECT_LT(in_phase, 1.07);
  EXPECT_GT(opposed, 0.6);
  EXPECT_LT(opposed, 0.85);
  const auto t1 = across_the_muscle(torso, made(torso, Series::t1, 1.8).image);
  EXPECT_GT(t1[8], t1[2]);  // in phase the grey rises from muscle to fat
  EXPECT_LT(t1[8], t1[14]);
}

TEST(MadeSeries, FatLiesBetweenSkinAndMuscle) {
  for (std::uint64_t body = 31; body <= 36; ++body) {
    const Torso torso(body);
    for (double x = -110; x <= 110; x += 10) {
      double y = -150, fat_mm = 0;
      for (; torso.at({x, y, 0}) != phantom::Stuff::muscle && y < 150; y += 0.25)
        fat_mm += torso.at({x, y, 0}) == phantom::Stuff::fat || torso.at({x, y, 0}) == phantom::Stuff::gland ? 0.25 : 0;
      EXPECT_GT(fat_mm, 2) << body << " " << x;
    }
  }
}

/// A half ball on a plate of muscle: a block of gland toward the head, on the side of +y, and a ligament over it.
GreyImage labelled_breast() {
  GreyImage labels;
  labels.grid.size = {46, 81, 81};
  labels.grid.origin_mm = {-5, -40, -40};
  for (int k = 0; k < 81; ++k)
    for (int j = 0; j < 81; ++j)
      for (int i = 0; i < 46; ++i) {
        const Eigen::Vector3d p = labels.grid.point(Eigen::Vector3d(i, j, k));
        float label = p.norm() < 40 && p.x() > 0 ? 1 : 0;
        if (p.x() <= 0 && std::hypot(p.y(), p.z()) < 40) label = 40;
        if (p.x() > 8 && p.x() < 24 && p.y() > 4 && p.y() < 20 && p.z() > 4 && p.z() < 20) label = p.z() < 17 ? 29 : 88;
        labels.voxels.push_back(label);
      }
  return labels;
}

TEST(Anatomy, LiesInTheDrawnBreastWhereItLiesInItsOwn) {
  Torso torso(seed);
  torso.carry(std::make_shared<phantom::Anatomy>(labelled_breast()));
  for (const int side : {0, 1}) {
    const phantom::DrawnBreast& b = torso.breasts()[side];
    const auto at = [&](double across, double up, double ahead) {
      return Eigen::Vector3d(b.foot_mm.x() + (side == 0 ? -1 : 1) * across * b.half_mm.x() + ahead * b.lean_mm.x(),
                             b.foot_mm.y() - ahead * b.hang_mm,
                             b.foot_mm.z() + up * b.half_mm.y() + ahead * b.lean_mm.y());
    };
    EXPECT_EQ(torso.at(at(0.3, 0.25, 0.4)), phantom::Stuff::gland) << side;  // outward on either side
    EXPECT_EQ(torso.at(at(-0.3, 0.25, 0.4)), phantom::Stuff::fat) << side;
    EXPECT_EQ(torso.at(at(0.3, -0.25, 0.4)), phantom::Stuff::fat) << side;
    EXPECT_EQ(torso.at(at(0.3, 0.25, 0.8)), phantom::Stuff::fat) << side;
    EXPECT_TRUE(torso.is_collagen(at(0.3, 0.46, 0.4))) << side;
    EXPECT_FALSE(torso.is_collagen(at(-0.3, 0.46, 0.4))) << side;
  }
}

TEST(Anatomy, RefusesWhatIsNoLabelledBreast) {
  GreyImage other = labelled_breast(), fatty = other;
  other.voxels[7] = 3;
  for (float& label : fatty.voxels) label = label == 29 ? 1 : label;
  const auto said = [](const GreyImage& labels) {
    return testing::message_of([&] { phantom::Anatomy anatomy(labels); });
  };
  EXPECT_NE(said(other).find("value 3 is no label"), std::string::npos);
  EXPECT_NE(said(fatty).find("no voxel is gland (label 29)"), std::string::npos);
  GreyImage turned = labelled_breast();  // x from the nipple to the chest
  std::reverse(turned.voxels.begin(), turned.voxels.end());
  EXPECT_NE(said(turned).find("no breast lies in front of the muscle"), std::string::npos) << said(turned);
}

TEST(MadeSeries, BreastAndGlandOfADrawnTorsoAreFoundWithFatSuppressed) {
  const Torso torso(seed);
  const MadeSeries series = made(torso, Series::fatsat, 1.6);
  const auto result = run_recipe(series.image, read_shipped_recipe("fatsat_auto"));
  const auto [breast, gland] = dice_of(torso, series, result.labels);
  EXPECT_GT(breast, 0.93);
  EXPECT_GT(gland, 0.6);
}

TEST(MadeSeries, BreastAndGlandOfADrawnTorsoAreFound) {
  const Torso torso(seed);
  const MadeSeries series = made(torso, Series::t1, 1.6);
  const auto result = run_recipe(series.image, read_shipped_recipe("t1_auto"));
  const auto [breast, gland] = dice_of(torso, series, result.labels);
  EXPECT_GT(breast, 0.93);
  EXPECT_GT(gland, 0.6);
  ASSERT_EQ(result.fraction_gland.size(), series.gland_share.size());
  double found = 0, truth = 0;
  for (std::size_t n = 0; n < series.gland_share.size(); ++n) {
    found += result.fraction_gland[n];
    truth += series.gland_share[n];
  }
  EXPECT_NEAR(found / truth, 1, 0.4);
}

TEST(MadeSeries, ImagesOfAnotherKindAreRefused) {
  const Torso torso(seed);
  const auto said = [&](Series series, const char* recipe) {
    return testing::message_of([&] { run_recipe(made(torso, series).image, read_shipped_recipe(recipe)); });
  };
  const std::string suppressed = said(Series::fatsat, "t1_auto"), plain = said(Series::t1, "fatsat_auto");
  EXPECT_NE(suppressed.find("fatsat_auto"), std::string::npos) << suppressed;
  EXPECT_NE(plain.find("t1_auto"), std::string::npos) << plain;
}

TEST(MadeSeries, AnImageThatEndsInABreastIsDoubted) {
  const Torso torso(seed);
  const MadeSeries series = made(torso, Series::t1);
  GreyImage half{series.image.grid, {}};  // up to the left nipple
  half.grid.size.x() = static_cast<int>(half.grid.continuous_index(torso.nipple_mm(1)).x());
  for (int k = 0; k < half.grid.size.z(); ++k)
    for (int j = 0; j < half.grid.size.y(); ++j)
      for (int i = 0; i < half.grid.size.x(); ++i) half.voxels.push_back(series.image.at(i, j, k));
  const auto result = run_recipe(half, read_shipped_recipe("t1_auto"));
  bool edge = false;
  for (const Doubt& doubt : result.doubts) edge = edge || doubt.what.find("ends inside a breast") != std::string::npos;
  EXPECT_TRUE(edge);
  for (const Picture& picture : pictures_of(result.doubts.front(), result.labels, half)) EXPECT_GT(picture.width, 50);
}

}  // namespace
}  // namespace supine::segmentation
