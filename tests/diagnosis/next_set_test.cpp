// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/next_set.h"

#include <gtest/gtest.h>

namespace supine::diagnosis {
namespace {

/// Sets with their probabilities, none followed but those named.
std::vector<Hypothesis> sets(const std::vector<std::pair<std::vector<int>, double>>& list,
                             const std::vector<std::size_t>& followed) {
  std::vector<Hypothesis> hypotheses;
  for (const auto& [effects, probability] : list) {
    hypotheses.emplace_back();
    hypotheses.back().effects = effects;
    hypotheses.back().probability = probability;
  }
  for (const std::size_t h : followed) hypotheses[h].refitted = true;
  return hypotheses;
}

TEST(NextSet, IsTheLikeliestThatWasNotFollowed) {
  const auto list = sets({{{1}, 0.5}, {{}, 0.2}, {{2}, 0.15}, {{1, 2}, 0.14}}, {0});
  EXPECT_EQ(next_to_refit(list), &list[2]);
}

TEST(NextSet, OfWhatHoldsMoreThanTheLikeliestHasToBeLikelier) {
  const auto list = sets({{{1}, 0.8}, {{1, 2}, 0.08}, {{3}, 0.05}}, {0});
  EXPECT_EQ(next_to_refit(list, 0.1), &list[2]);
  EXPECT_EQ(next_to_refit(list), &list[1]);
}

TEST(NextSet, IsNoneBeyondWhatHoldsNearlyAllOfTheProbability) {
  const auto list = sets({{{1}, 0.97}, {{}, 0.021}, {{2}, 0.009}}, {0});
  EXPECT_EQ(next_to_refit(list), nullptr);
  auto unsolved = sets({{{1}, 0.6}, {{2}, 0.4}}, {0});
  unsolved[1].unsolved = true;
  EXPECT_EQ(next_to_refit(unsolved), nullptr);
}

TEST(NextSet, SimplerIsTheLikeliestPartOfTheFirstThatLacksOneEffect) {
  auto list = sets({{{1, 2, 3}, 0.9}, {{4, 5}, 0.05}, {{1}, 0.03}, {{1, 3}, 0.01}, {{2, 3}, 0.001}}, {0});
  EXPECT_EQ(simpler_than_first(list), &list[3]);
  list[3].refitted = true;
  EXPECT_EQ(simpler_than_first(list), &list[4]);
  list[0].refitted = false;
  EXPECT_EQ(simpler_than_first(list), nullptr) << "the first was not followed itself";
}

}  // namespace
}  // namespace supine::diagnosis
