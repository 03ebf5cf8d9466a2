// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/beside.h"

#include <gtest/gtest.h>

#include <cmath>

namespace supine::diagnosis {
namespace {

void add(Findings& found, const std::vector<int>& effects, double probability, const BaseFit* ground = nullptr) {
  Hypothesis h;
  h.effects = effects;
  h.probability = probability;
  h.ln_evidence = std::log(probability);
  h.ground = ground;
  found.hypotheses.push_back(h);
}

TEST(Beside, TheSurestEffectIsTheOneThatSetsWithoutItSpeakLeastAgainst) {
  Findings found;
  add(found, {2, 5}, 0.90), add(found, {5}, 0.09), add(found, {2}, 0.009), add(found, {}, 0.001);
  EXPECT_EQ(surest_part(found), (std::vector{5}));
  found.beside.push_back({{5}, std::make_unique<BaseFit>()});
  EXPECT_EQ(surest_part(found), std::vector<int>{}) << "effect 2 has 0.91";
}

TEST(Beside, NothingIsMeasuredAnewWhereNoEffectIsSureOrNothingMoreIsLikely) {
  Findings unsure;
  add(unsure, {2, 5}, 0.6), add(unsure, {1}, 0.3), add(unsure, {}, 0.1);
  EXPECT_EQ(surest_part(unsure), std::vector<int>{});
  Findings alone;
  add(alone, {5}, 0.6), add(alone, {2, 5}, 0.3995), add(alone, {}, 0.0005);
  EXPECT_EQ(surest_part(alone), std::vector<int>{});
}

TEST(Beside, AnEffectThatWouldNotBeNamedIfTheScansCountedForHalfIsAskedAgainOnce) {
  Findings found;
  add(found, {5}, 0.97), add(found, {}, 0.03);
  EXPECT_EQ(surest_part(found), (std::vector{5}));
  found.beside.push_back({{5}, std::make_unique<BaseFit>()});
  EXPECT_EQ(surest_part(found), std::vector<int>{});
  found.beside.back().effects = {2};
  EXPECT_EQ(surest_part(found), (std::vector{5})) << "the likeliest set does not hold what they were measured beside";
}

TEST(Beside, AThirdEffectIsJudgedBesideTwoThatAreSure) {
  Findings found;
  add(found, {1, 2, 5}, 0.7), add(found, {2, 5}, 0.29), add(found, {5}, 0.01);
  found.beside.push_back({{5}, std::make_unique<BaseFit>()});
  EXPECT_EQ(surest_part(found), (std::vector{2, 5}));
}

TEST(Beside, OddsOfWhatIsSureStayWhatTheyWere) {
  Findings found;
  found.beside.push_back({{5}, std::make_unique<BaseFit>(), 5, std::log(200), 0});
  const BaseFit* ground = found.beside.back().ground.get();
  add(found, {2, 5}, 1e-30, ground), add(found, {5}, 3e-30, ground), add(found, {}, 0.4), add(found, {2}, 0.1);
  keep_odds(found);
  EXPECT_NEAR(ln_odds_of(found.hypotheses, {5}), std::log(200), 1e-9);
  normalise(found.hypotheses);
  EXPECT_NEAR(inclusion(found.hypotheses, 5), 200.0 / 201, 1e-9);
  EXPECT_EQ(found.hypotheses.front().effects, (std::vector{5}));
  EXPECT_NEAR(found.hypotheses.front().probability, 0.75 * 200 / 201, 1e-9);
}

}  // namespace
}  // namespace supine::diagnosis
