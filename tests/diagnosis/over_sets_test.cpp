// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/over_sets.h"

#include <gtest/gtest.h>

namespace supine::diagnosis {
namespace {

/// Two effects, each by itself and both together; numbers as value, low, high.
class OverSets : public testing::Test {
 protected:
  OverSets() {
    for (const char* name : {"part_stiffness", "support_compliance"}) found_.candidates.emplace_back().effect = name;
  }

  void add(std::vector<int> effects, double probability, std::vector<FittedParameter> numbers) {
    Refit& refit = found_.refits.emplace_back();
    for (const int effect : effects)
      refit.effects.push_back(found_.candidates[static_cast<std::size_t>(effect)].effect);
    refit.solved = true;
    refit.parameters = std::move(numbers);
    Hypothesis& hypothesis = found_.hypotheses.emplace_back();
    hypothesis.effects = std::move(effects);
    hypothesis.probability = probability;
  }

  static FittedParameter ratio(double value, double low, double high) {
    return {"part_stiffness.log_ratio", "1", value, low, high};
  }

  Findings found_;
};

TEST_F(OverSets, EqualPosteriorsMixToThemselves) {
  add({0}, 0.5, {ratio(0.3, -0.7, 0.8)});
  add({0, 1}, 0.1, {ratio(0.3, -0.7, 0.8), {"support_compliance.turn_deg_per_nm", "deg/(N m)", 20, 10, 30}});
  const auto numbers = over_sets(found_, "part_stiffness");
  ASSERT_EQ(numbers.size(), 1u);
  EXPECT_EQ(numbers[0].name, "part_stiffness.log_ratio");
  // Halves of different width weigh as they are wide: a little more than 2.5 % lies beyond the wider one's end.
  EXPECT_NEAR(numbers[0].low, -0.7, 0.12);
  EXPECT_NEAR(numbers[0].high, 0.8, 0.08);
}

TEST_F(OverSets, ANumberThatSetsDisagreeOnIsAsWideAsBothSay) {
  add({0}, 0.3, {ratio(0.5, 0.1, 0.9)});
  add({0, 1}, 0.3, {ratio(-0.3, -0.7, 0.1)});
  const auto numbers = over_sets(found_, "part_stiffness");
  ASSERT_EQ(numbers.size(), 1u);
  EXPECT_NEAR(numbers[0].value, 0.1, 1e-6);
  // 5 % of the lower one lie below: its 1.645 standard deviations of 0.4 / 1.96.
  EXPECT_NEAR(numbers[0].low, -0.3 - 1.645 * 0.4 / 1.96, 1e-3);
  EXPECT_NEAR(numbers[0].high, 0.5 + 1.645 * 0.4 / 1.96, 1e-3);
}

TEST_F(OverSets, AnUnlikelySetHardlyCounts) {
  add({0}, 0.9, {ratio(0.5, 0.1, 0.9)});
  add({0, 1}, 0.001, {ratio(-3, -4, -2)});
  const auto numbers = over_sets(found_, "part_stiffness");
  EXPECT_NEAR(numbers.at(0).low, 0.1, 0.02);
  EXPECT_NEAR(numbers.at(0).high, 0.9, 0.02);
}

TEST_F(OverSets, OneSetAloneSaysItsOwn) {
  add({0}, 0.5, {ratio(0.5, 0.1, 0.9)});
  add({1}, 0.5, {{"support_compliance.turn_deg_per_nm", "deg/(N m)", 20, 10, 30}});
  EXPECT_TRUE(over_sets(found_, "part_stiffness").empty());
}

}  // namespace
}  // namespace supine::diagnosis
