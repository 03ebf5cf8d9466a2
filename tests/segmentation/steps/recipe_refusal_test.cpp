// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>
#include <gtest/gtest.h>

#include "segmentation/steps/recipe_toml.h"
#include "tests/segmentation/formats/image_files.h"

namespace supine::segmentation {
namespace {

using namespace testing;

std::string refusal(const std::string& text, const std::string& frame = "LPS") {
  const toml::table table = toml::parse(text);
  return message_of([&] { read_recipe(TomlReader(table, "case.toml", "segmentation"), frame); });
}

struct BadStep {
  std::string name;
  std::string step;  ///< its keys, from line 5 on
  int line;
  std::string complaint;  ///< key, value, what to do
};

class RefusedStep : public ::testing::TestWithParam<BadStep> {};

TEST_P(RefusedStep, NamesFileLineStepKeyAndWhatToDo) {
  const BadStep& row = GetParam();
  const std::string message = refusal("[[step]]\ndo = \"holes\"\nmask = \"a\"\n[[step]]\n" + row.step);
  EXPECT_EQ(message, fmt::format("case.toml:{}: [segmentation.step 2] {}", row.line, row.complaint));
}

INSTANTIATE_TEST_SUITE_P(
    Recipe, RefusedStep,
    ::testing::Values(
        BadStep{"UnknownStep", "do = \"treshold\"", 5, "do = \"treshold\": unknown step; did you mean threshold?"},
        BadStep{"StepLikeNoOther", "do = \"segment\"", 5,
                "do = \"segment\": unknown step; known here: noise_floor, bias, smooth, threshold, grow, islands, "
                "holes, combine, morph, layer, region, paint, body, chest, planes, otsu, march or gland"},
        BadStep{"NoStep", "mask = \"a\"", 4, "do: is missing and must be given"},
        BadStep{"StepIsANumber", "do = 3", 5, "do = 3: must be a text in quotes"},
        BadStep{"UnknownKey", "do = \"noise_floor\"\nair_below = 6\nsigma = 1", 7,
                "sigma = 1: unknown key; known here: do or air_below"},
        BadStep{"MisspeltKey", "do = \"noise_floor\"\nair_bellow = 6", 6,
                "air_bellow = 6: unknown key; did you mean air_below?"},
        BadStep{"KeyOfTheOtherSpeed",
                "do = \"march\"\nmask = \"a\"\nseeds_mm = [[1, 2, 3]]\nspeed = \"gradient\"\nhalf_per_mm = 2\nstop_mm "
                "= 9\nsd = 1",
                11,
                "sd = 1: unknown key; known here: do, mask, seeds_mm, speed, sigma_mm, half_per_mm, stop_mm, order or "
                "within"},
        BadStep{"MisspeltNeededKey", "do = \"holes\"\nmsak = \"a\"", 4,
                "mask: is missing and must be given; is msak meant for it?"},
        BadStep{"NotPositive", "do = \"noise_floor\"\nair_below = 0", 6, "air_below = 0: must be > 0"},
        BadStep{"NotANumber", "do = \"noise_floor\"\nair_below = \"60\"", 6,
                "air_below = \"60\": must be a finite number"},
        BadStep{"NotFinite", "do = \"bias\"\nlevel = inf", 6, "level = inf: must be a finite number"},
        BadStep{"DegreeTooHigh", "do = \"bias\"\nlower = 1\ndegree = 5", 7, "degree = 5: must be >= 0 and <= 4"},
        BadStep{"DegreeWithAFraction", "do = \"bias\"\nlower = 1\ndegree = 1.5", 7,
                "degree = 1.5: must be a whole number"},
        BadStep{"NoKind", "do = \"smooth\"\nradius_mm = 1", 4, "kind: is missing and must be given"},
        BadStep{"MisspeltKind", "do = \"smooth\"\nkind = \"gausian\"\nradius_mm = 1", 6,
                "kind = \"gausian\": must be median or gaussian; did you mean gaussian?"},
        BadStep{"NoRadius", "do = \"smooth\"\nkind = \"median\"", 4, "radius_mm: is missing and must be given"},
        BadStep{"NoGreys", "do = \"threshold\"\nmask = \"a\"", 4,
                "lower: is missing; give lower, upper or both (greys)"},
        BadStep{"GreysSwapped", "do = \"threshold\"\nmask = \"a\"\nlower = 5\nupper = 4", 7,
                "lower = 5: must not be above upper = 4"},
        BadStep{"NoMask", "do = \"threshold\"\nlower = 5", 4, "mask: is missing and must be given"},
        BadStep{"EmptyMask", "do = \"holes\"\nmask = \"\"", 6, "mask = \"\": must not be empty"},
        BadStep{"OtsuOneClass", "do = \"otsu\"\nmask = \"a\"\nclasses = 1", 7, "classes = 1: must be >= 2 and <= 8"},
        BadStep{"OtsuLastBeforeFirst", "do = \"otsu\"\nmask = \"a\"\nclasses = 4\nfirst = 3\nlast = 2", 9,
                "last = 2: must be >= 3 and <= 4"},
        BadStep{"NoSeeds", "do = \"grow\"\nmask = \"a\"\nlower = 1", 4, "seeds_mm: is missing and must be given"},
        BadStep{"EmptySeeds", "do = \"grow\"\nmask = \"a\"\nlower = 1\nseeds_mm = []", 8,
                "seeds_mm = []: must not be empty: give points of three numbers [x, y, z]"},
        BadStep{"SeedOfTwoNumbers", "do = \"grow\"\nmask = \"a\"\nlower = 1\nseeds_mm = [[1, 2]]", 8,
                "seeds_mm = [[1, 2]]: must hold points of three numbers [x, y, z] only"},
        BadStep{"SeedsNotNested", "do = \"grow\"\nmask = \"a\"\nlower = 1\nseeds_mm = 4", 8,
                "seeds_mm = 4: must be a list of points of three numbers [x, y, z] in square brackets"},
        BadStep{"GrowWithoutGreys", "do = \"grow\"\nmask = \"a\"\nseeds_mm = [[1, 2, 3]]", 4,
                "lower: is missing; give lower, upper or both (greys)"},
        BadStep{"GrowTooOften", "do = \"grow\"\nmask = \"a\"\nseeds_mm = [[1, 2, 3]]\nmultiplier = 2\niterations = 51",
                9, "iterations = 51: must be >= 0 and <= 50"},
        BadStep{"MarchWithoutSpread",
                "do = \"march\"\nmask = \"a\"\nseeds_mm = [[1, 2, 3]]\nspeed = \"greys\"\nmean = 9\nstop_mm = 9", 4,
                "sd: is missing and must be given"},
        BadStep{"MarchThirdOrder",
                "do = \"march\"\nmask = \"a\"\nseeds_mm = [[1, 2, 3]]\nspeed = \"greys\"\nmean = 9\nsd = 1\nstop_mm = "
                "9\norder = 3",
                12, "order = 3: must be >= 1 and <= 2"},
        BadStep{"NothingToKeep", "do = \"islands\"\nmask = \"a\"", 4,
                "keep_largest: is missing; give keep_largest (number), min_ml or both, above 0"},
        BadStep{"NegativeVolume", "do = \"islands\"\nmask = \"a\"\nmin_ml = -1", 7, "min_ml = -1: must be >= 0"},
        BadStep{"NothingToCombine", "do = \"combine\"\nmask = \"a\"", 4,
                "any: is missing; give masks in any, without or both"},
        BadStep{"MasksNotAList", "do = \"combine\"\nmask = \"a\"\nany = \"b\"", 7,
                "any = \"b\": must be a list of texts in quotes in square brackets"},
        BadStep{"MasksOfNumbers", "do = \"combine\"\nmask = \"a\"\nany = [\"b\", 3]", 7,
                "any = [\"b\", 3]: must hold texts in quotes only"},
        BadStep{"MisspeltMorph", "do = \"morph\"\nmask = \"a\"\nkind = \"dialte\"\nradius_mm = 1", 7,
                "kind = \"dialte\": must be dilate, erode, open or close; did you mean dilate?"},
        BadStep{"LayerWithoutThickness", "do = \"layer\"\nmask = \"a\"\nof = \"b\"", 4,
                "thickness_mm: is missing and must be given"},
        BadStep{"UnknownShape", "do = \"region\"\nmask = \"a\"\nshape = \"ball\"\ncentre_mm = [0, 0, 0]", 7,
                "shape = \"ball\": must be cylinder, sphere, box or halfspace"},
        BadStep{"CentreOfTwoNumbers",
                "do = \"region\"\nmask = \"a\"\nshape = \"sphere\"\ncentre_mm = [0, 0]\nradius_mm = 1", 8,
                "centre_mm = [0, 0]: must be three numbers [x, y, z], each finite"},
        BadStep{"AxisZero",
                "do = \"region\"\nmask = \"a\"\nshape = \"halfspace\"\ncentre_mm = [0, 0, 0]\naxis = [0, 0, 0]", 9,
                "axis = [0, 0, 0]: must not be zero"},
        BadStep{"BoxWithoutSides", "do = \"region\"\nmask = \"a\"\nshape = \"box\"\ncentre_mm = [0, 0, 0]", 4,
                "half_mm: is missing and must be given"},
        BadStep{"BoxFlat", "do = \"region\"\nmask = \"a\"\nshape = \"box\"\ncentre_mm = [0, 0, 0]\nhalf_mm = [1, 0, 1]",
                9, "half_mm = [1, 0, 1]: must be > 0, each half side"},
        BadStep{"UnknownTissue", "do = \"paint\"\nmask = \"a\"\ntissue = \"fat\"", 7,
                "tissue = \"fat\": \"fat\" is no tissue; known here: air, adipose, gland, skin, muscle, tumour, "
                "nipple, vessel, ligament or excluded"},
        BadStep{"MisspeltTissueUnder", "do = \"paint\"\nmask = \"a\"\ntissue = \"skin\"\nover = [\"glend\"]", 8,
                "over = [\"glend\"]: \"glend\" is no tissue; did you mean gland?"},
        BadStep{"AirAboveLower", "do = \"body\"\nmask = \"a\"\nlower = 5\nair = 6", 8,
                "air = 6: must not be above lower = 5"},
        BadStep{"EdgeShareOne", "do = \"body\"\nmask = \"a\"\nedge_share = 1", 7,
                "edge_share = 1: must be >= 0 and <= 0.9"},
        BadStep{"ChestWithoutBody", "do = \"chest\"\nmask = \"a\"", 4, "body: is missing and must be given"},
        BadStep{"UnknownBorder", "do = \"chest\"\nmask = \"a\"\nbody = \"b\"\nborder = \"edge\"", 8,
                "border = \"edge\": must be step or line"},
        BadStep{"BrightBelowDark", "do = \"chest\"\nmask = \"a\"\nbody = \"b\"\ndark = 70\nbright = 60", 9,
                "bright = 60: must be above dark = 70"},
        BadStep{"BothPlaceAndOffset",
                "do = \"planes\"\nmask = \"a\"\nbody = \"b\"\nchest = \"c\"\nsuperior_mm = 1\nsuperior_offset_mm = 2",
                10, "superior_offset_mm = 2: has no effect beside superior_mm; leave one of them out"},
        BadStep{"UnknownSide", "do = \"planes\"\nmask = \"a\"\nbody = \"b\"\nchest = \"c\"\nside = \"lefft\"", 9,
                "side = \"lefft\": must be both, left or right; did you mean left?"}),
    [](const auto& row) { return row.param.name; });

TEST(RecipeRefusal, OfWhatIsNotAListOfSteps) {
  EXPECT_EQ(refusal(""), "case.toml:1: [segmentation] step: is missing and must be given");
  const std::string tables = "must be tables: write [[segmentation.step]], with two brackets, on a line of its own";
  EXPECT_EQ(refusal("step = 3"), "case.toml:1: [segmentation] step = 3: " + tables);
  EXPECT_EQ(refusal("step = []"), "case.toml:1: [segmentation] step = []: " + tables);
  EXPECT_EQ(refusal("stepp = 1\n[[step]]\ndo = \"holes\"\nmask = \"a\""),
            "case.toml:1: [segmentation] stepp = 1: unknown key; did you mean step?");
}

TEST(RecipeRefusal, OfAFrameThatIsNone) {
  EXPECT_EQ(refusal("[[step]]\ndo = \"noise_floor\"", "LPX"),
            "case.toml:1: [segmentation] case.frame: \"LPX\" is not known; LPS or RAS expected");
}

/// The complaint about a recipe file, without the folder before its name.
std::string file_refusal(const std::string& text) {
  const TemporaryFolder folder;
  write_text(folder / "r.toml", text);
  const std::string message = message_of([&] { read_recipe_file(folder / "r.toml"); });
  const std::string before = folder.path().string() + "/";
  EXPECT_EQ(message.find(before), 0u) << message;
  return message.substr(std::min(before.size(), message.size()));
}

TEST(RecipeRefusal, OfARecipeFileNamesThatFile) {
  EXPECT_EQ(file_refusal("# T1\n[[segmentation.step]]\ndo = \"noise-floor\"\n"),
            "r.toml:3: [segmentation.step 1] do = \"noise-floor\": unknown step; did you mean noise_floor?");
  EXPECT_EQ(file_refusal("[[segmentaton.step]]\n"), "r.toml:1: segmentaton: unknown key; did you mean segmentation?");
  EXPECT_EQ(file_refusal(""),
            "r.toml:1: segmentation: table [segmentation] is missing: it holds the steps of the recipe");
  EXPECT_EQ(file_refusal("segmentation = 3"),
            "r.toml:1: segmentation = 3: must be a table: write [segmentation] on a line of its own");
  EXPECT_EQ(file_refusal("[[segmentation.step]]\ndo = \n").find("r.toml:2:"), 0u);
  EXPECT_NE(message_of([] { read_recipe_file("none.toml"); }).find("none.toml"), std::string::npos);
}

}  // namespace
}  // namespace supine::segmentation
