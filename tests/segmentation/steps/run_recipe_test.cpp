// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/run_recipe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "segmentation/steps/body.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using testing::message_of;

constexpr float infinite = std::numeric_limits<float>::infinity();

/// One row of voxels, 1 mm apart, first at x = 0.
GreyImage row(const std::vector<float>& greys) {
  GreyImage image;
  image.grid.size = {static_cast<int>(greys.size()), 1, 1};
  image.voxels = greys;
  return image;
}

Recipe recipe_of(std::vector<Step> steps) {
  Recipe recipe;
  recipe.steps = std::move(steps);
  return recipe;
}

/// Runs the steps and paints the mask "m" as adipose (1).
std::vector<int> run(const GreyImage& image, std::vector<Step> steps) {
  steps.push_back(Paint{"m", Tissue::adipose, {}});
  const auto labels = run_recipe(image, recipe_of(steps)).labels.voxels;
  return {labels.begin(), labels.end()};
}

TEST(RunRecipe, ThresholdKeepsBothBounds) {
  EXPECT_EQ(run(row({1, 2, 3, 4, 5}), {Threshold{"m", {2, 4}, ""}}), (std::vector<int>{0, 1, 1, 1, 0}));
  EXPECT_EQ(run(row({1, 2, 3, 4, 5}), {Threshold{"a", {3, infinite}, ""}, Threshold{"m", {-infinite, 4}, "a"}}),
            (std::vector<int>{0, 0, 1, 1, 0}));
}

TEST(RunRecipe, GrowReachesWhatIsConnectedToItsSeeds) {
  const GreyImage image = row({5, 5, 9, 5, 5, 5, 9, 5});
  EXPECT_EQ(run(image, {Grow{"m", {{4.2, 0, 0}}, {4, 6}, {}, ""}}), (std::vector<int>{0, 0, 0, 1, 1, 1, 0, 0}));
  EXPECT_EQ(run(image, {Grow{"m", {{0, 0, 0}, {7, 0, 0}}, {4, 6}, {}, ""}}),
            (std::vector<int>{1, 1, 0, 0, 0, 0, 0, 1}));
}

TEST(RunRecipe, GrowByConfidenceFindsTheRangeItself) {
  const GreyImage image = row({100, 104, 96, 102, 98, 300, 100, 100});
  const Grow::Confidence confidence{2.5, 5, 2};
  EXPECT_EQ(run(image, {Grow{"m", {{2, 0, 0}}, {}, confidence, ""}}), (std::vector<int>{1, 1, 1, 1, 1, 0, 0, 0}));
}

TEST(RunRecipe, SeedsAreFoundInPatientCoordinates) {
  // A flipped and shifted axis: index = 10 - x.
  GreyImage image = row({1, 1, 9, 1, 1});
  image.grid.direction.col(0) *= -1;
  image.grid.origin_mm.x() = 10;
  EXPECT_EQ(run(image, {Grow{"m", {{9.9, 0, 0}}, {0, 5}, {}, ""}}), (std::vector<int>{1, 1, 0, 0, 0}));
}

TEST(RunRecipe, IslandsAndHolesAreMeasuredInMillilitres) {
  GreyImage image = row({1, 0, 1, 1, 0, 1, 1, 1});
  image.grid.spacing_mm = {10, 10, 10};  // 1 ml each
  const Step bright = Threshold{"m", {1, 1}, ""};
  EXPECT_EQ(run(image, {bright, Islands{"m", 0, 2}}), (std::vector<int>{0, 0, 1, 1, 0, 1, 1, 1}));
  EXPECT_EQ(run(image, {bright, Islands{"m", 1, 0}}), (std::vector<int>{0, 0, 0, 0, 0, 1, 1, 1}));
}

TEST(RunRecipe, CombineIsUnionWithout) {
  const GreyImage image = row({1, 2, 3, 4});
  const Step one = Threshold{"one", {1, 1}, ""}, two = Threshold{"two", {2, 3}, ""},
             three = Threshold{"three", {3, 3}, ""};
  EXPECT_EQ(run(image, {one, two, three, Combine{"m", {"one", "two"}, {"three"}}}), (std::vector<int>{1, 1, 0, 0}));
  EXPECT_EQ(run(image, {one, Combine{"m", {}, {"one"}}}), (std::vector<int>{0, 1, 1, 1}));
}

TEST(RunRecipe, LayerIsTheOutermostVoxels) {
  GreyImage image = row({0, 1, 1, 1, 1, 1, 0});
  image.grid.spacing_mm.x() = 1.5;
  const Step body = Threshold{"body", {1, 1}, ""};
  EXPECT_EQ(run(image, {body, Layer{"m", "body", 1.6}}), (std::vector<int>{0, 1, 0, 0, 0, 1, 0}));
  EXPECT_EQ(run(image, {body, Layer{"m", "body", 3.1}}), (std::vector<int>{0, 1, 1, 0, 1, 1, 0}));
}

TEST(RunRecipe, RegionsLieInPatientCoordinates) {
  const GreyImage image = row({0, 0, 0, 0, 0, 0});
  Region region{"m", Region::Shape::sphere, {2, 0, 0}, {0, 0, 1}, {1, 1, 1}, 1.2};
  EXPECT_EQ(run(image, {region}), (std::vector<int>{0, 1, 1, 1, 0, 0}));
  region.shape = Region::Shape::halfspace;
  region.axis = {2, 0, 0};
  EXPECT_EQ(run(image, {region}), (std::vector<int>{0, 0, 1, 1, 1, 1}));
  region.shape = Region::Shape::box;
  region.half_mm = {2, 1, 1};
  EXPECT_EQ(run(image, {region}), (std::vector<int>{1, 1, 1, 1, 1, 0}));
  region.shape = Region::Shape::cylinder;
  region.axis = {0, 0, 5};
  EXPECT_EQ(run(image, {region}), (std::vector<int>{0, 1, 1, 1, 0, 0}));
  region.axis = {1, 0, 0};
  EXPECT_EQ(run(image, {region}), (std::vector<int>{1, 1, 1, 1, 1, 1}));
}

TEST(RunRecipe, MorphClosesGapsAndOpensBridges) {
  const GreyImage image = row({0, 0, 0, 1, 1, 0, 1, 1, 1, 0, 0, 0});
  const Step bright = Threshold{"m", {1, 1}, ""};
  EXPECT_EQ(run(image, {bright, Morph{"m", Morph::Kind::close, 1}}),
            (std::vector<int>{0, 0, 0, 1, 1, 1, 1, 1, 1, 0, 0, 0}));
  EXPECT_EQ(run(image, {bright, Morph{"m", Morph::Kind::open, 1}}),
            (std::vector<int>{0, 0, 0, 0, 0, 0, 1, 1, 1, 0, 0, 0}));
}

TEST(RunRecipe, PaintOverSomeTissuesOnly) {
  const GreyImage image = row({1, 2, 3});
  const Recipe recipe = recipe_of({Threshold{"left", {1, 1}, ""}, Combine{"all", {}, {"left"}},
                                   Paint{"left", Tissue::skin, {}}, Paint{"all", Tissue::gland, {}},
                                   Combine{"any", {"left", "all"}, {}}, Paint{"any", Tissue::muscle, {Tissue::gland}}});
  const auto labels = run_recipe(image, recipe).labels.voxels;
  EXPECT_EQ(labels, (std::vector<std::uint8_t>{3, 4, 4}));
}

TEST(RunRecipe, LogsEveryStep) {
  const auto result = run_recipe(row({1, 2, 3}), recipe_of({Threshold{"m", {2, 3}, ""}, Paint{"m", Tissue::skin, {}}}));
  ASSERT_EQ(result.log.size(), 2u);
  EXPECT_EQ(result.log[0], "step 1 (threshold): m: 2 voxels, 0.0 ml");
}

TEST(RunRecipe, RefusesWhatCannotWorkAndNamesTheStep) {
  const GreyImage image = row({1, 2, 3});
  const Step all = Threshold{"m", {0, 9}, ""};
  const auto message = [&](const Step& step) { return message_of([&] { run_recipe(image, recipe_of({all, step})); }); };
  EXPECT_NE(
      message(Islands{"skin", 1, 0}).find("step 2 (islands): no earlier step made the mask \"skin\"; there are \"m\""),
      std::string::npos);
  EXPECT_NE(message(Threshold{"m", {50, 60}, ""}).find("comes out empty"), std::string::npos);
  EXPECT_NE(message(Grow{"g", {{7, 0, 0}}, {0, 9}, {}, ""}).find("seed (7.0, 0.0, 0.0) mm lies outside the image"),
            std::string::npos);
  EXPECT_NE(message(Grow{"g", {{2, 0, 0}}, {0, 2}, {}, ""}).find("has grey 3, outside 0 to 2"), std::string::npos);
}

TEST(FindBody, SpecksOfNoiseDoNotCloseTheAir) {
  GreyImage image;
  image.grid.size = {40, 40, 20};
  image.grid.spacing_mm = {1.5, 1.5, 3};
  std::mt19937 random(4);
  std::bernoulli_distribution speck(0.05);
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i) image.voxels.push_back(j >= 20 ? 100.0f : speck(random) ? 60.0f : 10.0f);
  Body step;
  step.lower = 50;
  step.air = 34;
  step.gap_mm = 4;
  const Mask body = find_body(image, step);
  for (int k = 0; k < 20; ++k)
    for (int i = 0; i < 40; ++i) {
      EXPECT_TRUE(body[image.grid.index(i, 21, k)]);
      EXPECT_FALSE(body[image.grid.index(i, 8, k)]);
    }
}

TEST(FindBody, AirDoesNotRunAlongUnderTheSkin) {  // out of phase, a dark row parts bright skin from fat
  GreyImage image;
  image.grid.size = {60, 40, 20};
  image.grid.spacing_mm = {1.2, 1.2, 3};
  const auto hole = [](int i) { return i >= 25 && i < 35; };
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 60; ++i)
        image.voxels.push_back(j < 20 ? 5.0f : j < 22 ? (hole(i) ? 70.0f : 285.0f) : j == 22 ? 30.0f : 100.0f);
  Body step;
  step.lower = 50;
  step.air = 34;
  step.gap_mm = 4;
  step.peel_mm = 8;
  step.edge_share = 0.38f;
  const Mask body = find_body(image, step);
  for (int k = 0; k < 20; ++k)
    for (int i = 0; i < 60; ++i) {
      EXPECT_FALSE(body[image.grid.index(i, 15, k)]);
      for (const int j : {20, 21, 22, 24}) {
        if (i >= 20 && i < 40) continue;
        EXPECT_TRUE(body[image.grid.index(i, j, k)]) << i << " " << j;
      }
    }
}

}  // namespace
}  // namespace supine::segmentation
