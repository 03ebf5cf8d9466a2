// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/steps/recipe_toml.h"

#include <gtest/gtest.h>

#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using namespace testing;

Recipe read(const std::string& text, const std::string& frame = "LPS") {
  const toml::table table = toml::parse(text);
  return read_recipe(TomlReader(table, "case.toml", "segmentation"), frame);
}

TEST(RecipeToml, ReadsEveryKindOfStep) {
  const Recipe recipe = read(R"(
    [[step]]
    do = "noise_floor"
    air_below = 60
    [[step]]
    do = "bias"
    lower = 500
    degree = 3
    [[step]]
    do = "smooth"
    kind = "gaussian"
    radius_mm = 1.5
    [[step]]
    do = "threshold"
    mask = "a"
    upper = 12.5
    within = "b"
    [[step]]
    do = "grow"
    mask = "a"
    seeds_mm = [[1, 2, 3], [4.5, 5, 6]]
    multiplier = 2
    [[step]]
    do = "islands"
    mask = "a"
    keep_largest = 2
    [[step]]
    do = "holes"
    mask = "a"
    max_ml = 3
    [[step]]
    do = "combine"
    mask = "a"
    any = ["b", "c"]
    without = ["d"]
    [[step]]
    do = "morph"
    mask = "a"
    kind = "open"
    radius_mm = 2
    [[step]]
    do = "layer"
    mask = "a"
    of = "b"
    thickness_mm = 2.2
    [[step]]
    do = "region"
    mask = "a"
    shape = "box"
    centre_mm = [1, 2, 3]
    half_mm = [4, 5, 6]
    [[step]]
    do = "paint"
    mask = "a"
    tissue = "gland"
    over = ["adipose", "skin"]
    [[step]]
    do = "body"
    mask = "a"
    lower = 40
    [[step]]
    do = "chest"
    mask = "a"
    body = "b"
    border = "line"
    sternum_mm = 3
    [[step]]
    do = "planes"
    mask = "a"
    body = "b"
    chest = "c"
    side = "left"
    mid_axillary_mm = 70
    inframammary_offset_mm = -5
    [[step]]
    do = "otsu"
    mask = "a"
    classes = 4
    first = 2
    last = 3
    [[step]]
    do = "march"
    mask = "a"
    seeds_mm = [[1, 2, 3]]
    speed = "greys"
    mean = 100
    sd = 20
    stop_mm = 30
    [[step]]
    do = "gland"
    mask = "a"
    body = "b"
    breast = "d"
    chest = "c"
    contrast = "bright"
    failed_share = 2
    fat_shift = "none"
  )");
  ASSERT_EQ(recipe.steps.size(), std::variant_size_v<Step>);
  for (std::size_t s = 0; s < recipe.steps.size(); ++s) EXPECT_EQ(recipe.steps[s].index(), s);
  EXPECT_EQ(std::get<Bias>(recipe.steps[1]).degree, 3);
  EXPECT_EQ(std::get<Bias>(recipe.steps[1]).level, 100);
  EXPECT_EQ(std::get<Gland>(recipe.steps[17]).options.contrast, GlandOptions::Contrast::bright);
  EXPECT_EQ(std::get<Gland>(recipe.steps[17]).options.failed_share, 2);
  EXPECT_FALSE(std::get<Gland>(recipe.steps[17]).options.find_fat_shift);
  EXPECT_EQ(std::get<Threshold>(recipe.steps[3]).grey.upper, 12.5f);
  const auto& grow = std::get<Grow>(recipe.steps[4]);
  EXPECT_EQ(grow.seeds_mm[1], Eigen::Vector3d(4.5, 5, 6));
  EXPECT_EQ(grow.confidence->multiplier, 2);
  EXPECT_EQ(std::get<Combine>(recipe.steps[7]).any, (std::vector<std::string>{"b", "c"}));
  EXPECT_EQ(std::get<Region>(recipe.steps[10]).half_mm, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(std::get<Body>(recipe.steps[12]).lower, 40);
  EXPECT_EQ(std::get<Chest>(recipe.steps[13]).options.border, ChestWallOptions::Border::line);
  EXPECT_EQ(std::get<Chest>(recipe.steps[13]).sternum_mm, 3);
  EXPECT_EQ(std::get<Planes>(recipe.steps[14]).mid_axillary.at_mm, 70);
  EXPECT_EQ(std::get<Otsu>(recipe.steps[15]).last, 3);
  EXPECT_EQ(std::get<March>(recipe.steps[16]).speed, March::Speed::greys);
  EXPECT_EQ(std::get<March>(recipe.steps[16]).stop_mm, 30);
  EXPECT_EQ(std::get<Planes>(recipe.steps[14]).inframammary.offset_mm, -5);
  EXPECT_EQ(std::get<Paint>(recipe.steps[11]).over, (std::vector<Tissue>{Tissue::adipose, Tissue::skin}));
}

TEST(RecipeToml, CoordinatesInRasAreTurnedIntoLps) {
  const Recipe recipe = read(
      "[[step]]\ndo = \"region\"\nmask = \"a\"\nshape = \"halfspace\"\ncentre_mm = [1, 2, 3]\naxis = [0, 1, 0]\n"
      "[[step]]\ndo = \"grow\"\nmask = \"a\"\nseeds_mm = [[1, 2, 3]]\nlower = 1\n",
      "RAS");
  EXPECT_EQ(std::get<Region>(recipe.steps[0]).centre_mm, Eigen::Vector3d(-1, -2, 3));
  EXPECT_EQ(std::get<Region>(recipe.steps[0]).axis, Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(std::get<Grow>(recipe.steps[1]).seeds_mm[0], Eigen::Vector3d(-1, -2, 3));
}

TEST(RecipeToml, RecipeFileHoldsTheSameTable) {
  const TemporaryFolder folder;
  write_text(folder / "r.toml", "[[segmentation.step]]\ndo = \"noise_floor\"\nair_below = 60\n");
  EXPECT_EQ(read_recipe_file(folder / "r.toml").steps.size(), 1u);
}

}  // namespace
}  // namespace supine::segmentation
