// SPDX-License-Identifier: AGPL-3.0-or-later
// Gland by two series of one visit: where the second lies, what both say together, and fat that the scanner moved.
#include "segmentation/gland/second_series.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "segmentation/gland/fat_shift.h"
#include "segmentation/gland/gland.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using Eigen::Vector3d;

Grid grid_of(int x, int y, int z, double spacing_mm, const Vector3d& origin_mm) {
  Grid grid;
  grid.size = {x, y, z};
  grid.spacing_mm.setConstant(spacing_mm);
  grid.origin_mm = origin_mm;
  return grid;
}

/// 1 inside, 0 outside, the border smooth over two mm.
double soft(double depth_mm) { return 1 / (1 + std::exp(-3 * depth_mm)); }

double body_at(const Vector3d& p) { return soft(std::min(46 - std::hypot(p.x() - 56, p.z() - 56), p.y() - 8)); }

/// Gland: a lump, and a bar that has no symmetry with it.
double gland_at(const Vector3d& p) {
  const double lump = 14 - (p - Vector3d(56, 50, 52)).norm();
  const double bar = 4 - std::hypot(p.x() - 48 - 0.4 * (p.z() - 56), p.y() - 30);
  return soft(std::max(lump, bar)) * body_at(p);
}

/// The grey of a series in which fat and gland have these, fat moved by @p fat_shift.
template <class Places>
GreyImage series(const Grid& grid, double fat, double gland, double noise, const Places& tissue_at,
                 const Vector3d& fat_shift = Vector3d::Zero()) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise);
  GreyImage image{grid, {}};
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const Vector3d p = tissue_at(grid.point(Vector3d(i, j, k))), from = p - fat_shift;
        const double signal = fat * (body_at(from) - gland_at(from)) + gland * gland_at(p);
        image.voxels.push_back(static_cast<float>(std::abs(signal + normal(random))));
      }
  return image;
}

const auto in_place = [](const Vector3d& p) { return p; };

/// The share of gland as the holes in the fat lie, which were moved by @p fat_shift.
std::vector<float> holes_share(const Grid& grid, const Vector3d& fat_shift) {
  std::vector<float> share;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i)
        share.push_back(static_cast<float>(gland_at(grid.point(Vector3d(i, j, k)) - fat_shift)));
  return share;
}

/// A breast hanging from a chest, in a series without fat suppression.
struct Breast {
  Grid grid = grid_of(56, 56, 56, 2, Vector3d::Zero());
  Mask body, breast, chest, under_skin, truth;
  GlandPlace place{body, breast, chest, 0, 80, 200};
  Breast() {
    for (int k = 0; k < 56; ++k)
      for (int j = 0; j < 56; ++j)
        for (int i = 0; i < 56; ++i) {
          const Vector3d p = grid.point(Vector3d(i, j, k));
          body.push_back(body_at(p) > 0.5);
          chest.push_back(body.back() && p.y() > 96);
          breast.push_back(body.back() && !chest.back());
          under_skin.push_back(breast.back() && gland_at(p) < 0.01);
          truth.push_back(gland_at(p) > 0.5);
        }
  }
  double dice(const Mask& gland) const { return dice_of(gland, truth); }
  static double dice_of(const Mask& a, const Mask& b) {
    double both = 0, sum = 0;
    for (std::size_t n = 0; n < a.size(); ++n) both += a[n] && b[n], sum += a[n] + b[n];
    return 2 * both / sum;
  }
  /// Where the holes in the fat lie, which the scanner moved.
  Mask holes(const Vector3d& fat_shift) const {
    Mask mask;
    for (const float share : holes_share(grid, fat_shift)) mask.push_back(share > 0.5F);
    return mask;
  }
};

TEST(SecondSeries, IsFoundWhereItLiesWhateverItsContrastAndGrid) {
  const Breast b;
  const GreyImage first = series(b.grid, 100, 40, 2, in_place);
  const Vector3d shift(3, -2.5, 1.5);
  const GreyImage suppressed = series(grid_of(80, 80, 60, 1.6, Vector3d(-8, -8, 6)), 30, 120, 3,
                                      [&](const Vector3d& p) { return Vector3d(p - shift); });
  const SecondSeries found = lay_over(suppressed, first, b.breast, b.under_skin);
  EXPECT_LT((found.shift_mm - shift).cwiseAbs().maxCoeff(), 0.51);
  const std::size_t lump = b.grid.index(28, 25, 26), fat = b.grid.index(14, 28, 28);
  EXPECT_NEAR(found.image.voxels[lump], 400, 30) << "fat has the grey 100";
  EXPECT_NEAR(found.image.voxels[fat], 100, 20);
  EXPECT_TRUE(std::isnan(found.image.voxels[0])) << "outside the breast";
}

TEST(SecondSeries, OfAnotherBodyOrPlaceIsRefused) {
  const Breast b;
  const GreyImage first = series(b.grid, 100, 40, 2, in_place);
  const auto said = [&](const GreyImage& second) {
    return testing::message_of([&] { lay_over(second, first, b.breast, b.under_skin); });
  };
  GreyImage noise{b.grid, {}};
  std::mt19937 random(4);
  std::uniform_real_distribution<float> any(0, 100);
  for (std::size_t n = 0; n < b.grid.count(); ++n) noise.voxels.push_back(any(random));
  EXPECT_NE(said(noise).find("does not show this body"), std::string::npos) << said(noise);
  const GreyImage away = series(b.grid, 30, 120, 3, [](const Vector3d& p) { return Vector3d(p + Vector3d(0, 0, 11)); });
  EXPECT_NE(said(away).find("bound 10 mm along each axis"), std::string::npos) << said(away);
  const GreyImage half = series(grid_of(56, 56, 26, 2, Vector3d::Zero()), 30, 120, 3, in_place);
  EXPECT_NE(said(half).find("of the breast (bound 90 %)"), std::string::npos) << said(half);
  GreyImage black = series(b.grid, 0, 120, 0.01, in_place);
  for (float& grey : black.voxels) grey = grey > 1 ? grey : 0;
  EXPECT_NE(said(black).find("no brighter than its noise"), std::string::npos) << said(black);
}

SeriesContrast contrast(float value, float deviation, double pure, bool usable) {
  return {{{value}, {deviation}, {1}, deviation}, pure, {usable}};
}

TEST(ShareByBoth, WeighsEachByWhatItTells) {
  const FatLevel both = share_by_both(contrast(0.35F, 0.1F, 0.7, true), contrast(0.6F, 0.3F, 1.5, true));
  const double a = 0.7 * 0.7 / 0.01, b = 1.5 * 1.5 / 0.09;  // information of either on the share
  EXPECT_NEAR(both.contrast[0], (a * 0.5 + b * 0.4) / (a + b), 1e-6);
  EXPECT_NEAR(both.deviation[0], 1 / std::sqrt(a + b), 1e-6);
  EXPECT_NEAR(both.sd, both.deviation[0], 1e-9);
  const FatLevel alone = share_by_both(contrast(0.35F, 0.1F, 0.7, true), contrast(9.0F, 0.3F, 1.5, false));
  EXPECT_NEAR(alone.contrast[0], 0.5, 1e-6);
  EXPECT_NEAR(alone.deviation[0], 0.1 / 0.7, 1e-6);
}

TEST(FatShift, IsFoundAlongItsAxisAndNoneWhereThereIsNone) {
  const Breast b;
  for (const Vector3d& shift : {Vector3d(2, 0, 0), Vector3d(0, 0, -1.5), Vector3d(0, 0, 0)}) {
    const GreyImage image = series(b.grid, 100, 40, 2, in_place, shift);
    const FatShift found = find_fat_shift(image, holes_share(b.grid, shift), b.breast);
    EXPECT_LT((found.fat_mm - shift).norm(), 0.51) << shift.transpose();
    EXPECT_LT(found.laid_mm.norm(), 0.51) << shift.transpose();
  }
  EXPECT_TRUE(find_fat_shift(series(b.grid, 100, 40, 2, in_place), std::vector<float>(b.grid.count(), 0), b.breast)
                  .fat_mm.isZero(0))
      << "no gland to see it by";
}

TEST(FatShift, WhatIsMovedIsReadFromThere) {
  const Grid grid = grid_of(6, 3, 3, 2, Vector3d::Zero());
  SeriesContrast ramp{
      {{}, std::vector<float>(grid.count(), 0.1F), std::vector<float>(grid.count(), 1), 0.1}, 1, Mask(grid.count(), 1)};
  for (std::size_t n = 0; n < grid.count(); ++n) ramp.fat.contrast.push_back(static_cast<float>(n % 6));
  const SeriesContrast there = moved(ramp, grid, Vector3d(3, 0, 0));
  EXPECT_NEAR(there.fat.contrast[grid.index(1, 1, 1)], 2.5, 1e-6);
  EXPECT_FALSE(there.usable[grid.index(5, 1, 1)]) << "beyond the image";
}

TEST(GlandByTwoSeries, OfOneKindAreRefused) {
  const Breast b;
  const GreyImage first = series(b.grid, 100, 40, 3, in_place);
  GlandOptions options;
  options.second = GlandOptions::Contrast::bright;
  const std::string said = testing::message_of([&] { find_gland(first, b.place, options, &first); });
  EXPECT_NE(said.find("with fat suppression and one without"), std::string::npos) << said;
}

TEST(GlandByOneSeries, IsPutBackWhereFatLiesAsideAndElseLeft) {
  const Breast b;
  const Vector3d fat_shift(2.5, 0, 0);
  const GlandResult back = find_gland(series(b.grid, 100, 40, 2, in_place, fat_shift), b.place, {});
  ASSERT_TRUE(back.fat_shift_mm);
  EXPECT_LT((*back.fat_shift_mm - fat_shift).norm(), 0.76) << back.fat_shift_mm->transpose();
  EXPECT_GT(b.dice(back.gland), 0.9);
  double share = 0, truth = 0;
  for (std::size_t n = 0; n < back.fraction.size(); ++n) share += back.fraction[n], truth += b.truth[n];
  EXPECT_NEAR(share / truth, 1, 0.1);
  EXPECT_FALSE(find_gland(series(b.grid, 100, 40, 2, in_place), b.place, {}).fat_shift_mm);
  GlandOptions left, bright;
  left.find_fat_shift = false;
  const GlandResult as_in_grey = find_gland(series(b.grid, 100, 40, 2, in_place, fat_shift), b.place, left);
  EXPECT_FALSE(as_in_grey.fat_shift_mm);
  EXPECT_GT(Breast::dice_of(as_in_grey.gland, b.holes(fat_shift)), b.dice(as_in_grey.gland) + 0.05);
  bright.contrast = GlandOptions::Contrast::bright;
  EXPECT_FALSE(find_gland(series(b.grid, 30, 120, 3, in_place, fat_shift), b.place, bright).fat_shift_mm);
}

TEST(GlandByTwoSeries, FatThatIsNotLookedForIsNotMoved) {
  const Breast b;
  const Vector3d fat_shift(4, 0, 0);
  const GreyImage first = series(b.grid, 100, 40, 4, in_place, fat_shift);
  const GreyImage second = series(b.grid, 30, 120, 8, in_place);
  GlandOptions options;
  options.second = GlandOptions::Contrast::bright;
  options.find_fat_shift = false;
  const GlandResult left = find_gland(first, b.place, options, &second);
  ASSERT_TRUE(left.second);
  EXPECT_TRUE(left.second->fat_shift_mm.isZero(0));
  EXPECT_FALSE(left.fat_shift_mm);
  options.find_fat_shift = true;
  const GlandResult back = find_gland(first, b.place, options, &second);
  EXPECT_LT((back.second->fat_shift_mm - fat_shift).norm(), 0.76);
  EXPECT_GT(b.dice(back.gland), b.dice(left.gland) + 0.03);
}

TEST(GlandByTwoSeries, IsBetterThanByTheNoisierAndLiesWhereTheGlandIs) {
  const Breast b;
  const Vector3d fat_shift(2, 0, 0), moved_by(1, -2, 0);
  const GreyImage first = series(b.grid, 100, 40, 12, in_place, fat_shift);
  const GreyImage second = series(grid_of(70, 70, 70, 1.7, Vector3d(-2, -2, -2)), 30, 120, 3,
                                  [&](const Vector3d& p) { return Vector3d(p - moved_by); });
  GlandOptions options;
  const GlandResult alone = find_gland(first, b.place, options, &second);
  EXPECT_FALSE(alone.second) << "not asked for";
  options.second = GlandOptions::Contrast::bright;
  const GlandResult both = find_gland(first, b.place, options, &second);
  ASSERT_TRUE(both.second);
  EXPECT_LT((both.second->shift_mm - moved_by).norm(), 0.9);
  EXPECT_LT((both.second->fat_shift_mm - fat_shift).norm(), 0.51);
  EXPECT_GT(b.dice(both.gland), b.dice(alone.gland) + 0.03);
  EXPECT_GT(b.dice(both.gland), 0.86);
}

}  // namespace
}  // namespace supine::segmentation
