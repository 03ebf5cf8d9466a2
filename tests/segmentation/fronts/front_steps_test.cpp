// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "segmentation/steps/recipe_toml.h"
#include "segmentation/steps/run_recipe.h"
#include "tests/segmentation/formats/image_files.h"

// The steps otsu and march of a recipe: read, run, refused.
namespace supine::segmentation {
namespace {

using testing::message_of;

Recipe read(const std::string& steps) {
  const toml::table table = toml::parse(steps);
  return read_recipe(TomlReader(table, "case.toml", "segmentation"));
}

GreyImage row(const std::vector<float>& greys) {
  GreyImage image;
  image.grid.size = {static_cast<int>(greys.size()), 1, 1};
  image.voxels = greys;
  return image;
}

/// Runs the steps and returns where the mask "m" is.
std::vector<int> mask_of(const GreyImage& image, const std::string& steps) {
  const Recipe recipe = read(steps + "\n[[step]]\ndo = \"paint\"\nmask = \"m\"\ntissue = \"adipose\"\n");
  const auto labels = run_recipe(image, recipe).labels.voxels;
  return {labels.begin(), labels.end()};
}

TEST(OtsuStep, TakesTheBrightestClassUnlessToldOtherwise) {
  const GreyImage image = row({0, 1, 50, 51, 100, 101});
  EXPECT_EQ(mask_of(image, "[[step]]\ndo = \"otsu\"\nmask = \"m\"\nclasses = 3"), (std::vector<int>{0, 0, 0, 0, 1, 1}));
  EXPECT_EQ(mask_of(image, "[[step]]\ndo = \"otsu\"\nmask = \"m\"\nclasses = 3\nfirst = 2\nlast = 2"),
            (std::vector<int>{0, 0, 1, 1, 0, 0}));
  EXPECT_EQ(mask_of(image, "[[step]]\ndo = \"otsu\"\nmask = \"m\"\nclasses = 3\nfirst = 1\nlast = 2"),
            (std::vector<int>{1, 1, 1, 1, 0, 0}));
}

TEST(OtsuStep, LooksOnlyWithinItsMask) {
  const GreyImage image = row({0, 0, 0, 50, 51, 100, 101});
  EXPECT_EQ(mask_of(image,
                    "[[step]]\ndo = \"threshold\"\nmask = \"body\"\nlower = 40\n"
                    "[[step]]\ndo = \"otsu\"\nmask = \"m\"\nwithin = \"body\"\nfirst = 1\nlast = 1"),
            (std::vector<int>{0, 0, 0, 1, 1, 0, 0}));
}

TEST(OtsuStep, RefusesClassesThatAreNotThere) {
  const auto refusal = [](const std::string& keys) {
    return message_of([&] { read("[[step]]\ndo = \"otsu\"\nmask = \"m\"\n" + keys); });
  };
  EXPECT_NE(refusal("classes = 9").find("classes = 9: must be >= 2 and <= 8"), std::string::npos);
  EXPECT_NE(refusal("classes = 3\nfirst = 4").find("first = 4: must be >= 1 and <= 3"), std::string::npos);
  EXPECT_NE(refusal("classes = 3\nfirst = 3\nlast = 2").find("last = 2: must be >= 3 and <= 3"), std::string::npos);
  EXPECT_NE(message_of([] {
              mask_of(row({7, 7, 8, 8}), "[[step]]\ndo = \"otsu\"\nmask = \"m\"\nclasses = 3");
            }).find("step 1 (otsu)"),
            std::string::npos);
}

TEST(MarchStep, ReachesABallInAnEvenVolume) {
  GreyImage image;
  image.grid.size = {41, 41, 41};
  image.grid.spacing_mm = {1, 1, 1};
  image.voxels.assign(image.grid.count(), 100);
  const auto mask = mask_of(image,
                            "[[step]]\ndo = \"march\"\nmask = \"m\"\nseeds_mm = [[20, 20, 20]]\nspeed = "
                            "\"gradient\"\nhalf_per_mm = 5\nstop_mm = 15");
  const double volume = static_cast<double>(std::count(mask.begin(), mask.end(), 1));
  // The corner of the arrival time at the seed costs a coarse grid some tenths of a voxel.
  EXPECT_NEAR(std::cbrt(3 * volume / (4 * std::numbers::pi)), 15, 0.5);
}

TEST(MarchStep, StaysInTheTissueItsSpeedIsOf) {
  const GreyImage image = row({100, 98, 103, 20, 100, 101});
  const std::string step =
      "[[step]]\ndo = \"march\"\nmask = \"m\"\nseeds_mm = [[0, 0, 0]]\nspeed = \"greys\"\nmean = 100\nsd = 5\nstop_mm "
      "= ";
  EXPECT_EQ(mask_of(image, step + "50"), (std::vector<int>{1, 1, 1, 0, 0, 0}));
  EXPECT_EQ(mask_of(image, step + "1.5"), (std::vector<int>{1, 1, 0, 0, 0, 0}));
  EXPECT_EQ(mask_of(image, "[[step]]\ndo = \"threshold\"\nmask = \"w\"\nupper = 102\n" + step + "50\nwithin = \"w\""),
            (std::vector<int>{1, 1, 0, 0, 0, 0}));
}

TEST(MarchStep, RefusesAStartInAirAndMissingNumbers) {
  const GreyImage image = row({100, 98, 0});
  const std::string step = "[[step]]\ndo = \"march\"\nmask = \"m\"\nspeed = \"greys\"\nmean = 100\nsd = 5\n";
  const std::string in_air = message_of([&] { mask_of(image, step + "stop_mm = 5\nseeds_mm = [[2, 0, 0]]"); });
  EXPECT_NE(in_air.find("step 1 (march)"), std::string::npos) << in_air;
  EXPECT_NE(in_air.find("the speed at source (2.0, 0.0, 0.0) mm is 0"), std::string::npos) << in_air;
  const std::string outside = message_of([&] { mask_of(image, step + "stop_mm = 5\nseeds_mm = [[9, 0, 0]]"); });
  EXPECT_NE(outside.find("outside the image"), std::string::npos) << outside;
  EXPECT_NE(message_of([&] { read(step + "seeds_mm = [[0, 0, 0]]"); }).find("stop_mm: is missing"), std::string::npos);
  EXPECT_NE(message_of([&] {
              read("[[step]]\ndo = \"march\"\nmask = \"m\"\nspeed = \"gradient\"\nseeds_mm = [[0, 0, 0]]\nstop_mm = 5");
            }).find("half_per_mm: is missing"),
            std::string::npos);
}

}  // namespace
}  // namespace supine::segmentation
