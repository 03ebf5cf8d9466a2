// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/suggestion.h"

#include <gtest/gtest.h>

namespace supine {
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

TEST(Suggestion, IsTheNearestNameOrAllOfThem) {
  EXPECT_EQ(suggestion("stpe", {"step", "line"}), "did you mean step?");
  EXPECT_EQ(suggestion("border", {"step", "line"}), "known here: step or line");
}

}  // namespace
}  // namespace supine
