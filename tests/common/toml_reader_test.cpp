// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/toml_reader.h"

#include "tests/pipeline/temporary_folder.h"

namespace supine::pipeline {
namespace {

TEST(NearestName, FindsASlipOfTheFinger) {
  const std::vector<std::string> known = {"ligament", "adhesion", "gravity_tilt"};
  EXPECT_EQ(nearest_name("ligamnet", known), "ligament");
  EXPECT_EQ(nearest_name("gravity-tilt", known), "gravity_tilt");
  EXPECT_EQ(nearest_name("adhesions", known), "adhesion");
}

TEST(NearestName, IsSilentWhenNothingIsClose) {
  EXPECT_EQ(nearest_name("temperature", {"ligament", "adhesion"}), "");
  EXPECT_EQ(nearest_name("x", {"yz"}), "");
}

TEST(Listed, JoinsWithCommasAndOr) {
  EXPECT_EQ(listed({"a"}), "a");
  EXPECT_EQ(listed({"a", "b"}), "a or b");
  EXPECT_EQ(listed({"a", "b", "c"}), "a, b or c");
}

TEST(TomlReader, AComplaintNamesFileLineTableKeyAndValue) {
  const toml::table table = toml::parse("\n\n[a]\nb = 3\n");
  const TomlReader file(table, "x.toml", "");
  EXPECT_EQ(input_error([&] { file.sub_table("a")->fail("b", "must be 4"); }), "x.toml:4: [a] b = 3: must be 4");
}

TEST(TomlReader, AnEmptyTextIsRefused) {
  const toml::table table = toml::parse("b = \"\"");
  EXPECT_NE(input_error([&] { TomlReader(table, "x.toml", "").text("b"); }), "");
}

}  // namespace
}  // namespace supine::pipeline
