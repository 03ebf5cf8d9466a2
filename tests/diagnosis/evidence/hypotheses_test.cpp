// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/hypotheses.h"

#include <gtest/gtest.h>

namespace supine::diagnosis {
namespace {

Hypothesis screened(std::vector<int> effects, double ln_evidence) {
  Hypothesis h;
  h.effects = std::move(effects);
  h.ln_evidence = h.screened = ln_evidence;
  return h;
}

TEST(Hypotheses, WhatWasNotFollowedFallsByTheSmallestFallOfWhatWasOrThatOfItsParts) {
  std::vector<Hypothesis> list = {screened({}, 0),  screened({0}, 5),   screened({1}, 4), screened({0, 1}, 6),
                                  screened({2}, 3), screened({3}, 0.5), screened({4}, -2)};
  list[1].ln_evidence = 2, list[1].refitted = true;  // fell by 3
  list[2].ln_evidence = 3, list[2].refitted = true;  // by 1
  list[4].unsolved = true;                           // says nothing of how far lines lead astray
  for (int twice = 0; twice < 2; ++twice) {
    lower_unfollowed(list);
    EXPECT_EQ(list[0].ln_evidence, 0) << "nothing is fitted, not screened";
    EXPECT_EQ(list[1].ln_evidence, 2);
    EXPECT_EQ(list[2].ln_evidence, 3);
    EXPECT_EQ(list[3].ln_evidence, 3) << "holds effect 0, of which lines promise 3 too much";
    EXPECT_EQ(list[4].ln_evidence, 2);
    EXPECT_EQ(list[5].ln_evidence, 0) << "no lower than nothing";
    EXPECT_EQ(list[6].ln_evidence, -2);
  }
}

TEST(Hypotheses, ARiseOfWhatWasFollowedRaisesNothing) {
  std::vector<Hypothesis> list = {screened({0}, 5), screened({1}, 4)};
  list[0].ln_evidence = 9, list[0].refitted = true;
  lower_unfollowed(list);
  EXPECT_EQ(list[1].ln_evidence, 4);
}

TEST(Hypotheses, WhatWasFollowedAgainSaysNothingOfLines) {
  std::vector<Hypothesis> list = {screened({}, 0), screened({0}, 5), screened({1}, 4)};
  list[1].refitted = list[1].again = true;
  list[1].ln_evidence = 2;
  lower_unfollowed(list);
  EXPECT_EQ(list[2].ln_evidence, 4);
}

TEST(Hypotheses, LinesFromARefitLeadAstrayInTheirOwnWay) {
  std::vector<Hypothesis> list = {screened({}, 0), screened({0}, 5), screened({1}, 4), screened({0, 2}, 8),
                                  screened({0, 3}, 7)};
  list[3].drawn_at = list[4].drawn_at = 0;
  list[1].ln_evidence = 4, list[1].refitted = true;  // by 1 from the base fit
  list[3].ln_evidence = 5, list[3].refitted = true;  // by 3 from that refit
  lower_unfollowed(list);
  EXPECT_EQ(list[2].ln_evidence, 3);
  EXPECT_EQ(list[4].ln_evidence, 4);
}

TEST(Hypotheses, NothingFallsWhereNothingWasFollowed) {
  std::vector<Hypothesis> list = {screened({}, 0), screened({0}, 5)};
  lower_unfollowed(list);
  EXPECT_EQ(list[1].ln_evidence, 5);
}

}  // namespace
}  // namespace supine::diagnosis
