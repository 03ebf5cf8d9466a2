// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/gland/gland.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "segmentation/gland/bspline_field.h"
#include "segmentation/gland/gland_outline.h"
#include "segmentation/gland/tissue_classes.h"

namespace supine::segmentation {
namespace {

Grid cube(int n, double spacing) {
  Grid grid;
  grid.size.setConstant(n);
  grid.spacing_mm.setConstant(spacing);
  return grid;
}

TEST(BSplineField, FollowsASmoothFieldThroughNoiseAndIgnoresWeightlessSamples) {
  const Grid grid = cube(40, 3);
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.05f);
  const auto truth = [](int i, int j, int k) {
    return static_cast<float>(0.8 * std::sin(i / 14.0) + 0.01 * j - 0.3 * std::cos(k / 20.0));
  };
  std::vector<FieldSample> samples;
  for (int k = 0; k < 40; k += 2)
    for (int j = 0; j < 40; j += 2)
      for (int i = 0; i < 40; i += 2) {
        samples.push_back({i, j, k, truth(i, j, k) + noise(random), 1});
        samples.push_back({i, j, k, 50, 0});
      }
  BSplineField field(grid, 0);
  for (const double spacing : {60.0, 60.0, 30.0, 30.0, 20.0}) {
    std::vector<FieldSample> left = samples;
    for (FieldSample& s : left) s.value -= static_cast<float>(field.at(s.i, s.j, s.k));
    field.add(left, spacing);
  }
  double squares = 0;
  int count = 0;
  const std::vector<float> values = field.evaluate();
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i, ++count) {
        const float value = values[grid.index(i, j, k)];
        EXPECT_NEAR(value, field.at(i, j, k), 1e-5);
        squares += std::pow(value - truth(i, j, k), 2);
      }
  EXPECT_LT(std::sqrt(squares / count), 0.03);
}

/// A ball of gland and one speck, in fat with noise.
struct Ball {
  Grid grid = cube(30, 2);
  std::vector<float> contrast, deviation;
  Mask within, truth;
  explicit Ball(float speck) {
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0, 0.2f);
    for (int k = 0; k < 30; ++k)
      for (int j = 0; j < 30; ++j)
        for (int i = 0; i < 30; ++i) {
          const bool gland = std::hypot(i - 15, j - 15, k - 15) < 8;
          truth.push_back(gland);
          contrast.push_back((gland ? 0.6f : 0) + noise(random));
          deviation.push_back(0.2f);
          within.push_back(1);
        }
    contrast[grid.index(3, 3, 3)] = speck;
  }
};

TEST(GlandClasses, NeighboursHelpAgainstNoise) {
  const Ball ball(0.7f);
  const auto errors = [&](double neighbourhood) {
    const GlandClasses classes =
        classify_gland(ball.contrast, ball.deviation, ball.within, ball.grid, 0.6, neighbourhood);
    int wrong = 0;
    for (std::size_t n = 0; n < ball.truth.size(); ++n) wrong += (classes.probability[n] > 0.5f) != bool(ball.truth[n]);
    return std::pair(wrong, classes.probability[ball.grid.index(3, 3, 3)]);
  };
  const auto [alone, speck_alone] = errors(0);
  const auto [together, speck_together] = errors(0.8);
  EXPECT_LT(together, alone / 3);
  EXPECT_GT(speck_alone, 0.5f);
  EXPECT_LT(speck_together, 0.5f);
}

TEST(GlandClasses, FindsTheShareOfGland) {
  const Ball ball(0);
  const GlandClasses classes = classify_gland(ball.contrast, ball.deviation, ball.within, ball.grid, 0.6, 0.6);
  double truth = 0;
  for (const auto gland : ball.truth) truth += gland;
  EXPECT_NEAR(classes.prior, truth / static_cast<double>(ball.truth.size()), 0.02);
}

/// A breast 90 mm across hanging from a chest, with a ball of gland, 30 % of it in a shell around the ball.
TEST(Gland, LabelsWhatIsMostlyGlandAndKeepsTheShareOfTheRest) {
  const Grid grid = cube(56, 2);
  GreyImage image{grid, {}};
  Mask body, breast, chest;
  std::vector<float> share;
  std::mt19937 random(11);
  std::normal_distribution<float> noise(0, 2);
  for (int k = 0; k < 56; ++k)
    for (int j = 0; j < 56; ++j)
      for (int i = 0; i < 56; ++i) {
        const bool inside = std::hypot(i - 28, k - 28) < 23 && j > 4;
        const double far = std::hypot(i - 28, j - 24, k - 28);
        share.push_back(far < 5 ? 1.0f : far < 8 ? 0.2f : 0.0f);
        body.push_back(inside);
        chest.push_back(inside && j >= 48);
        breast.push_back(inside && j < 48);
        image.voxels.push_back((inside ? 100 - 60 * share.back() : 0) + noise(random));
      }
  GlandOptions options;
  const GlandPlace place{body, breast, chest, -1, 40, 200};
  const GlandResult result = find_gland(image, place, options);
  double both = 0, sum = 0, core = 0, shell = 0, shell_voxels = 0;
  for (std::size_t n = 0; n < share.size(); ++n) {
    both += result.gland[n] && share[n] == 1;
    sum += result.gland[n] + (share[n] == 1);
    core += share[n] == 1;
    shell += share[n] == 0.2f ? result.fraction[n] : 0;
    shell_voxels += share[n] == 0.2f;
  }
  EXPECT_GT(2 * both / sum, 0.97);
  EXPECT_NEAR(shell / shell_voxels, 0.2, 0.05);
  options.least_share = 0;  // then what holds any gland is labelled
  const GlandResult any = find_gland(image, place, options);
  EXPECT_GT(std::count(any.gland.begin(), any.gland.end(), 1), 0.9 * (core + shell_voxels));
}

/// The same breast with its fat suppressed, which fails little by little around a place at its side.
TEST(Gland, FatWhoseSuppressionFailsLittleByLittleIsNotGland) {
  const Grid grid = cube(56, 2);
  GreyImage image{grid, {}};
  Mask body, breast, chest, ball, fails;
  std::mt19937 random(11);
  std::normal_distribution<float> noise(0, 4);
  for (int k = 0; k < 56; ++k)
    for (int j = 0; j < 56; ++j)
      for (int i = 0; i < 56; ++i) {
        const bool inside = std::hypot(i - 28, k - 28) < 23 && j > 4;
        const double from_place_mm = 2 * std::hypot(i - 44, j - 30, k - 28);
        ball.push_back(std::hypot(i - 24, j - 20, k - 28) < 5);
        fails.push_back(inside && from_place_mm < 12);
        body.push_back(inside);
        chest.push_back(inside && j >= 48);
        breast.push_back(inside && j < 48);
        const double bright = (ball.back() ? 150 : 0) + 90 * std::exp(-std::pow(from_place_mm / 14, 2));
        image.voxels.push_back(static_cast<float>(inside ? 100 + bright : 0) + noise(random));
      }
  GlandOptions options;
  options.contrast = GlandOptions::Contrast::bright;
  const GlandResult result = find_gland(image, {body, breast, chest, -1, 40, 200}, options);
  double in_ball = 0, of_ball = 0, failed = 0;
  for (std::size_t n = 0; n < ball.size(); ++n) {
    in_ball += ball[n] && result.gland[n];
    of_ball += ball[n];
    failed += fails[n] && result.gland[n];
  }
  EXPECT_GT(in_ball / of_ball, 0.95);
  EXPECT_EQ(failed, 0);
  EXPECT_GT(result.failed_ml, 1);
}

/// A slab of fat on one grid, whose contrast the tests draw.
struct Slab {
  Grid grid = cube(40, 1);
  FatLevel fat;
  Mask possible, sure;
  GlandOptions options;
  Slab() {
    fat.contrast.assign(grid.count(), 0);
    fat.deviation.assign(grid.count(), 0.03f);
    possible.assign(grid.count(), 1);
    sure.assign(grid.count(), 0);
    options.gap_mm = 0;
  }
  void draw(Eigen::Vector3i from, Eigen::Vector3i to, float contrast, bool is_sure) {
    for (int k = from.z(); k < to.z(); ++k)
      for (int j = from.y(); j < to.y(); ++j)
        for (int i = from.x(); i < to.x(); ++i) {
          fat.contrast[grid.index(i, j, k)] = contrast;
          sure[grid.index(i, j, k)] = is_sure;
        }
  }
  bool labelled(int i, int j, int k) const {
    return outline_gland(sure, possible, fat, grid, options)[grid.index(i, j, k)];
  }
};

TEST(GlandOutline, AStrandIsFollowedAsFarAsItShowsHalfOfWhatGlandShowsThere) {
  Slab slab;
  slab.draw({18, 5, 18}, {22, 20, 22}, 0.25f, true);    // a strand, thinner than its voxels: a quarter is gland
  slab.draw({18, 20, 18}, {22, 32, 22}, 0.14f, false);  // fades
  EXPECT_TRUE(slab.labelled(20, 10, 20));
  EXPECT_TRUE(slab.labelled(20, 27, 20));
  EXPECT_FALSE(slab.labelled(20, 36, 20));
  slab.draw({18, 5, 18}, {22, 20, 22}, 0.6f, true);  // beside solid gland the same grey is its rim, not a strand
  EXPECT_FALSE(slab.labelled(20, 24, 20));
}

TEST(GlandOutline, WhatHangsOnNothingSureIsNotGland) {
  Slab slab;
  slab.draw({18, 5, 18}, {22, 15, 22}, 0.25f, true);
  slab.draw({18, 22, 18}, {22, 28, 22}, 0.25f, false);
  EXPECT_FALSE(slab.labelled(20, 25, 20));
}

TEST(GlandOutline, NarrowGapsAreFilledAsAReaderDoes) {
  Slab slab;
  slab.draw({16, 5, 10}, {18, 35, 30}, 0.5f, true);
  slab.draw({21, 5, 10}, {23, 35, 30}, 0.5f, true);
  EXPECT_FALSE(slab.labelled(19, 20, 20));
  slab.options.gap_mm = 2.5;
  EXPECT_TRUE(slab.labelled(19, 20, 20));
  EXPECT_FALSE(slab.labelled(27, 20, 20));
}

/// Beside a coil the shading is steep: fat is twice as bright there as 30 mm farther in.
TEST(FatLevel, FollowsTheSteepShadingBesideACoil) {
  const Grid grid = cube(56, 2);
  GreyImage image{grid, {}};
  Mask inner, under_skin, beside;
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0, 3);
  for (int k = 0; k < 56; ++k)
    for (int j = 0; j < 56; ++j)
      for (int i = 0; i < 56; ++i) {
        const double radius = std::hypot(i - 28, k - 28), from_coil = 2 * std::hypot(i - 54, j - 24, k - 28);
        const bool gland = std::hypot(i - 20, j - 24, k - 28) < 5;
        inner.push_back(radius < 23 && j > 4);
        under_skin.push_back(inner.back() && radius > 18);
        beside.push_back(inner.back() && from_coil < 24);
        image.voxels.push_back(static_cast<float>((gland ? 40 : 100) * (1 + 2 * std::exp(-from_coil / 12))) +
                               noise(random));
      }
  const FatLevel fat = find_fat_level(image, inner, under_skin, GlandOptions::Contrast::dark, 20);
  double sum = 0, count = 0;
  for (std::size_t n = 0; n < beside.size(); ++n)
    if (beside[n]) {
      sum += fat.contrast[n];
      ++count;
    }
  EXPECT_NEAR(sum / count, 0, 0.05);
  EXPECT_NEAR(fat.contrast[grid.index(20, 24, 28)], 0.6, 0.06);
}

}  // namespace
}  // namespace supine::segmentation
