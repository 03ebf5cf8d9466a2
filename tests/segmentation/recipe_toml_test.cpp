// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/recipe_toml.h"

#include <gtest/gtest.h>

#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using namespace testing;

Recipe read(const std::string& text, const std::string& frame = "LPS") {
  return read_recipe(toml::parse(text), "case.toml [segmentation]", frame);
}

std::string refusal(const std::string& text) {
  return message_of([&] { read(text); });
}

void expect_refused(const std::string& step, const std::vector<std::string>& parts) {
  const std::string message = refusal("[[step]]\n" + step);
  for (const auto& part : parts) EXPECT_NE(message.find(part), std::string::npos) << step << "\n" << message;
  EXPECT_NE(message.find("case.toml [segmentation]"), std::string::npos) << message;
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
  )");
  ASSERT_EQ(recipe.steps.size(), std::variant_size_v<Step>);
  for (std::size_t s = 0; s < recipe.steps.size(); ++s) EXPECT_EQ(recipe.steps[s].index(), s);
  EXPECT_EQ(std::get<Bias>(recipe.steps[1]).degree, 3);
  EXPECT_EQ(std::get<Bias>(recipe.steps[1]).level, 100);
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

TEST(RecipeToml, RefusesWhatIsNotAListOfSteps) {
  EXPECT_NE(refusal("").find("step: missing"), std::string::npos);
  EXPECT_NE(refusal("step = 3").find("step"), std::string::npos);
  EXPECT_NE(refusal("stepp = 1\n[[step]]\ndo = \"holes\"\nmask = \"a\"").find("stepp: unknown key"), std::string::npos);
}

TEST(RecipeToml, RefusesStepsWithKeyValueAndBound) {
  expect_refused("do = \"treshold\"", {"step 1", "do: \"treshold\"", "threshold"});
  expect_refused("mask = \"a\"", {"do: missing"});
  expect_refused("do = \"noise_floor\"\nair_below = 0", {"air_below: 0", "> 0"});
  expect_refused("do = \"noise_floor\"\nair_below = \"60\"", {"air_below", "number"});
  expect_refused("do = \"noise_floor\"\nair_below = 6\nsigma = 1", {"line 4", "sigma: unknown key", "air_below"});
  expect_refused("do = \"body\"\nmask = \"a\"\nlower = 5\nair = 6", {"air: 6 is above lower = 5"});
  expect_refused("do = \"body\"\nmask = \"a\"\nedge_share = 1", {"edge_share: 1", "<= 0.9"});
  expect_refused("do = \"chest\"\nmask = \"a\"\nbody = \"b\"\nborder = \"edge\"", {"border: \"edge\"", "line, step"});
  expect_refused("do = \"chest\"\nmask = \"a\"\nbody = \"b\"\ndark = 70\nbright = 60", {"bright: 60", "dark = 70"});
  expect_refused("do = \"chest\"\nmask = \"a\"", {"body: missing"});
  expect_refused("do = \"planes\"\nmask = \"a\"\nbody = \"b\"\nchest = \"c\"\nside = \"up\"", {"side: \"up\"", "both"});
  expect_refused("do = \"planes\"\nmask = \"a\"\nbody = \"b\"\nchest = \"c\"\nsuperior_mm = 1\nsuperior_offset_mm = 2",
                 {"superior_offset_mm: has no effect"});
  expect_refused("do = \"bias\"\nlower = 1\ndegree = 5", {"degree: 5", "<= 4"});
  expect_refused("do = \"bias\"\nlower = 1\ndegree = 1.5", {"degree", "whole"});
  expect_refused("do = \"threshold\"\nmask = \"a\"\nlower = 5\nupper = 4", {"lower: 5 is above upper = 4"});
  expect_refused("do = \"threshold\"\nlower = 5", {"mask: missing"});
  expect_refused("do = \"grow\"\nmask = \"a\"\nlower = 1\nseeds_mm = []", {"seeds_mm", "at least one point"});
  expect_refused("do = \"grow\"\nmask = \"a\"\nlower = 1\nseeds_mm = [[1, 2]]", {"seeds_mm", "3 numbers"});
  expect_refused("do = \"islands\"\nmask = \"a\"", {"keep_largest: missing"});
  expect_refused("do = \"islands\"\nmask = \"a\"\nmin_ml = -1", {"min_ml: -1", ">= 0"});
  expect_refused("do = \"region\"\nmask = \"a\"\nshape = \"ball\"\ncentre_mm = [0,0,0]", {"shape: \"ball\"", "sphere"});
  expect_refused("do = \"region\"\nmask = \"a\"\nshape = \"cylinder\"\ncentre_mm = [0,0,0]\naxis = [0,0,0]",
                 {"axis: must not be zero"});
  expect_refused("do = \"paint\"\nmask = \"a\"\ntissue = \"fat\"", {"tissue: \"fat\" is not a tissue", "adipose"});
}

TEST(RecipeToml, RecipeFileHoldsTheSameTable) {
  const TemporaryFolder folder;
  write_text(folder / "r.toml", "[[segmentation.step]]\ndo = \"noise_floor\"\nair_below = 60\n");
  EXPECT_EQ(read_recipe_file(folder / "r.toml").steps.size(), 1u);
  write_text(folder / "r.toml", "[[step]]\ndo = \"noise_floor\"\n");
  EXPECT_NE(message_of([&] { read_recipe_file(folder / "r.toml"); }).find("unknown key step"), std::string::npos);
  write_text(folder / "r.toml", "[[segmentation.step]]\ndo = \n");
  EXPECT_NE(message_of([&] { read_recipe_file(folder / "r.toml"); }).find("line 2"), std::string::npos);
  EXPECT_NE(message_of([&] { read_recipe_file(folder / "none.toml"); }).find("none.toml"), std::string::npos);
}

}  // namespace
}  // namespace supine::segmentation
