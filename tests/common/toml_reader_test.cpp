// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/toml_reader.h"

#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

TEST(TomlReader, AComplaintNamesFileLineTableKeyAndValue) {
  const toml::table table = toml::parse("\n\n[a]\nb = 3\n");
  const TomlReader file(table, "x.toml", "");
  EXPECT_EQ(input_error([&] { file.sub_table("a")->fail("b", "must be 4"); }), "x.toml:4: [a] b = 3: must be 4");
}

TEST(TomlReader, AnEmptyTextIsRefused) {
  const toml::table table = toml::parse("b = \"\"");
  EXPECT_NE(input_error([&] { TomlReader(table, "x.toml", "").text("b"); }), "");
}

/// What a reader of the one-line file @p text complains about when @p use reads it.
template <class Use>
std::string complaint(const char* text, Use use) {
  const toml::table table = toml::parse(text);
  return input_error([&] { use(TomlReader(table, "x.toml", "a")); });
}

TEST(TomlReader, ANumberKeepsItsBounds) {
  const auto with = [](Bounds bounds) { return [=](const TomlReader& r) { r.number("b", bounds); }; };
  EXPECT_EQ(complaint("b = 0", with(positive)), "x.toml:1: [a] b = 0: must be > 0");
  EXPECT_EQ(complaint("b = -0.5", with(not_negative)), "x.toml:1: [a] b = -0.5: must be >= 0");
  EXPECT_EQ(complaint("b = 3", with({.upper = 2})), "x.toml:1: [a] b = 3: must be <= 2");
  EXPECT_EQ(complaint("b = 3", with({1, 2})), "x.toml:1: [a] b = 3: must be >= 1 and <= 2");
  EXPECT_EQ(complaint("b = 0", with(not_negative)), "");
  EXPECT_EQ(complaint("b = 2", with({1, 2})), "");
  EXPECT_EQ(complaint("b = nan", with({})), "x.toml:1: [a] b = nan: must be a finite number");
}

TEST(TomlReader, AWholeNumberHasNoFraction) {
  const auto whole = [](const TomlReader& r) { r.whole_number("b", 0, 4); };
  EXPECT_EQ(complaint("b = 1.5", whole), "x.toml:1: [a] b = 1.5: must be a whole number");
  EXPECT_EQ(complaint("b = 5", whole), "x.toml:1: [a] b = 5: must be >= 0 and <= 4");
  const toml::table table = toml::parse("b = 2.0");
  const TomlReader reader(table, "x.toml", "a");
  EXPECT_EQ(reader.whole_number("b", 0, 4), 2);
  EXPECT_EQ(reader.whole_number("c", 0, 4), std::nullopt);
}

TEST(TomlReader, AVectorHasThreeNumbers) {
  const auto vector = [](const TomlReader& r) { r.vector("b"); };
  for (const char* value : {"3", "[1, 2]", "[1, 2, 3, 4]", "[1, 2, \"3\"]", "[1, 2, inf]"})
    EXPECT_EQ(complaint(("b = " + std::string(value)).c_str(), vector),
              "x.toml:1: [a] b = " + std::string(value) + ": must be three numbers [x, y, z], each finite");
  const toml::table table = toml::parse("b = [1, 2.5, -3]\nc = [[1, 2, 3], [4, 5, 6]]");
  const TomlReader reader(table, "x.toml", "a");
  EXPECT_EQ(*reader.vector("b"), Eigen::Vector3d(1, 2.5, -3));
  EXPECT_EQ(reader.vectors("c")->at(1), Eigen::Vector3d(4, 5, 6));
  EXPECT_FALSE(reader.vector("d") || reader.vectors("d"));
}

TEST(TomlReader, AListOfVectorsIsNotEmpty) {
  const auto vectors = [](const TomlReader& r) { r.vectors("b"); };
  const std::string what = "points of three numbers [x, y, z]";
  EXPECT_EQ(complaint("b = []", vectors), "x.toml:1: [a] b = []: must not be empty: give " + what);
  EXPECT_EQ(complaint("b = [[1, 2]]", vectors), "x.toml:1: [a] b = [[1, 2]]: must hold " + what + " only");
  EXPECT_EQ(complaint("b = 1", vectors), "x.toml:1: [a] b = 1: must be a list of " + what + " in square brackets");
}

TEST(TomlReader, AKeyThatWasNotAskedForIsUnknown) {
  const auto read = [](const TomlReader& r) {
    r.number("depth_mm");
    r.has("width_mm");
    r.allow_no_more();
  };
  EXPECT_EQ(complaint("depth_mm = 1\nwidth_mm = 2", read), "");
  EXPECT_EQ(complaint("depht_mm = 1", read), "x.toml:1: [a] depht_mm = 1: unknown key; did you mean depth_mm?");
  EXPECT_EQ(complaint("grey = 1", read), "x.toml:1: [a] grey = 1: unknown key; known here: depth_mm or width_mm");
}

TEST(TomlReader, AMissingKeyNamesTheOneThatMayBeMeantForIt) {
  const auto read = [](const TomlReader& r) { r.required_number("depth_mm"); };
  EXPECT_EQ(complaint("dept_mm = 1", read),
            "x.toml:1: [a] depth_mm: is missing and must be given; is dept_mm meant for it?");
  EXPECT_EQ(complaint("grey = 1", read), "x.toml:1: [a] depth_mm: is missing and must be given");
  const auto text = [](const TomlReader& r) { r.required_text("name"); };
  EXPECT_EQ(complaint("grey = 1", text), "x.toml:1: [a] name: is missing and must be given");
}

TEST(TomlReader, AChoiceStandsForAValue) {
  const auto read = [](const TomlReader& r) { return r.choice<int>("b", {{"one", 1}, {"three", 3}}); };
  EXPECT_EQ(complaint("b = \"thre\"", read), "x.toml:1: [a] b = \"thre\": must be one or three; did you mean three?");
  EXPECT_EQ(complaint("b = 3", read), "x.toml:1: [a] b = 3: must be a text in quotes");
  const toml::table table = toml::parse("b = \"three\"");
  EXPECT_EQ(read(TomlReader(table, "x.toml", "a")), 3);
  EXPECT_EQ(TomlReader(table, "x.toml", "a").choice<int>("c", {{"one", 1}}), std::nullopt);
}

}  // namespace
}  // namespace supine::pipeline
