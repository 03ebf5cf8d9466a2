// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/diagnose.h"

namespace supine::diagnosis {
namespace {

/// As many as the catalogue has.
const std::vector<std::string> effects = {
    "ligament", "adhesion", "misregistration", "friction", "creep", "a", "b", "c", "d", "e", "f", "g", "h", "i", "j",
    "k",        "l"};
constexpr Unexplained little{0.2, 0.1, 0.4}, much{1.8, 1.2, 2.3};

/// Hypotheses with these probabilities; the rest is that of "nothing".
std::vector<Hypothesis> hypotheses(const std::vector<std::pair<std::vector<int>, double>>& given) {
  std::vector<Hypothesis> list(1);
  double rest = 1;
  for (const auto& [set, probability] : given) {
    Hypothesis h;
    h.effects = set;
    h.ln_evidence = std::log(probability);
    rest -= probability;
    list.push_back(h);
  }
  list[0].ln_evidence = std::log(rest);
  normalise(list);
  return list;
}

Diagnosis decided(const std::vector<Hypothesis>& list, const Unexplained& left, double gain = 1) {
  const Priors priors;
  auto included = inclusions(list, effects, priors);
  for (Inclusion& one : included) one.left_out_gain = gain;
  return decide(list, effects, included, left, priors, {});
}

using Names = std::vector<std::string>;

TEST(Decide, AProbableEffectIsMissingWhateverElseIsLeft) {
  const Diagnosis d = decided(hypotheses({{{0}, 0.97}}), much);
  EXPECT_EQ(d.verdict, Verdict::missing);
  EXPECT_EQ(d.missing, Names{"ligament"});
}

TEST(Decide, SeveralAreMissingAtOnceAndARivalForOneMoreIsTold) {
  const Diagnosis d = decided(hypotheses({{{0, 1}, 0.72}, {{0, 1, 3}, 0.26}}), little);
  EXPECT_EQ(d.missing, (Names{"ligament", "adhesion"}));
  EXPECT_EQ(d.ambiguous_rest, Names{"friction"});
}

TEST(Decide, AnEffectAtTheEndOfItsRangeIsSomethingElseThatLooksLikeIt) {
  const Priors priors;
  const auto decided_at_end = [&](const std::vector<Hypothesis>& list) {
    auto included = inclusions(list, effects, priors);
    for (Inclusion& one : included)
      if (one.effect == "adhesion") one.ends_at = "adhesion.log_factor";
    return decide(list, effects, included, little, priors, {});
  };
  const Diagnosis alone = decided_at_end(hypotheses({{{1}, 0.97}}));
  EXPECT_EQ(alone.verdict, Verdict::unexplained);
  EXPECT_EQ(alone.missing, Names{"adhesion"});
  EXPECT_NE(alone.why.find("adhesion.log_factor"), std::string::npos) << alone.why;
  const Diagnosis beside = decided_at_end(hypotheses({{{0, 1}, 0.98}}));
  EXPECT_EQ(beside.missing, Names{"ligament"});
  EXPECT_EQ(beside.ambiguous_rest, Names{"adhesion"});
}

TEST(Decide, ALocalCauseThatIsNotListedIsUnexplainedBeforeAnythingIsAmbiguous) {
  auto list = hypotheses({{{1}, 0.6}});
  for (Hypothesis& h : list) h.with_unlisted = {0.1, 0, 0.88};
  const Diagnosis d = decided(list, little);
  EXPECT_EQ(d.verdict, Verdict::unexplained);
  EXPECT_EQ(d.missing, Names{"adhesion"});
  EXPECT_EQ(d.ambiguous_rest, Names{"adhesion"});
  EXPECT_NE(d.why.find("does not list has probability 0.98"), std::string::npos) << d.why;
  list = hypotheses({{{0}, 0.97}});
  for (Hypothesis& h : list) h.with_unlisted = {0.98, 0, 0};
  EXPECT_EQ(decided(list, little).missing, Names{"ligament"}) << "an effect that is sure is named beside it";
}

TEST(Decide, ALocalCauseThatIsLikelierThanAllEffectsIsUnexplainedWhereNothingIsUnlikely) {
  const auto with_local = [](double effect, double share) {
    auto list = hypotheses({{{1}, effect}});
    for (Hypothesis& h : list)
      if (h.effects.empty()) h.with_unlisted = {share, 0, 0};
    return decided(list, little);
  };
  const Diagnosis local = with_local(0.2, 0.8);
  EXPECT_EQ(local.verdict, Verdict::unexplained);
  EXPECT_EQ(local.missing, Names{"adhesion"});
  EXPECT_NE(local.why.find("probability 0.64, that nothing is missing 0.16"), std::string::npos) << local.why;
  const Diagnosis effect = with_local(0.55, 0.8);
  EXPECT_EQ(effect.verdict, Verdict::ambiguous);
  EXPECT_NE(effect.why.find("nothing is missing has probability 0.09"), std::string::npos) << effect.why;
  EXPECT_EQ(with_local(0.1, 0.1).verdict, Verdict::nothing_missing) << "no more than was believed before";
}

TEST(Decide, WhatWasLeftOutCanSpeakAgainstIt) {
  const Diagnosis d = decided(hypotheses({{{0}, 0.97}}), little, -4);
  EXPECT_EQ(d.verdict, Verdict::ambiguous);
  EXPECT_EQ(d.missing, Names{"ligament"});
  EXPECT_NE(d.why.find("speaks against ligament"), std::string::npos) << d.why;
}

TEST(Decide, TwoThatShareTheProbabilityCannotBeToldApartAndTheMeasurementComesFirst) {
  const Diagnosis d = decided(hypotheses({{{0}, 0.5}, {{2}, 0.4}}), little);
  EXPECT_EQ(d.verdict, Verdict::ambiguous);
  EXPECT_EQ(d.missing, (Names{"misregistration", "ligament"}));
}

TEST(Decide, NothingIsMissingWhereNothingIsLikeliest) {
  const Diagnosis d = decided(hypotheses({{{0}, 0.2}, {{1}, 0.1}}), little);
  EXPECT_EQ(d.verdict, Verdict::nothing_missing);
  EXPECT_TRUE(d.missing.empty());
}

TEST(Decide, WhatNoEffectExplainsIsSaid) {
  const Diagnosis d = decided(hypotheses({{{3}, 0.2}}), much);
  EXPECT_EQ(d.verdict, Verdict::unexplained);
  EXPECT_EQ(d.missing, Names{"friction"});
}

TEST(Inclusions, AreTheSumsOfSetsAndFactorsCompareOddsWithThoseOfThePrior) {
  const auto list = hypotheses({{{0}, 0.3}, {{0, 1}, 0.3}});
  const auto included = inclusions(list, effects, Priors{});
  EXPECT_EQ(included[0].effect, "ligament");
  EXPECT_NEAR(included[0].probability, 0.6, 1e-12);
  const double prior = (0.3 * 1 + 0.15 * 2 + 0.05 * 3) / 17;
  EXPECT_NEAR(included[0].bayes_factor, 1.5 / (prior / (1 - prior)), 1e-9);
}

TEST(PriorOfSets, IsSharedByTheSetsOfASize) {
  const Priors priors;
  EXPECT_DOUBLE_EQ(std::exp(priors.ln_of_set(effects, {})), 0.5);
  EXPECT_NEAR(std::exp(priors.ln_of_set(effects, {0, 1})), 0.15 / 136, 1e-12);
  EXPECT_NEAR(std::exp(priors.ln_of_set(effects, {0, 1, 2})), 0.05 / 680, 1e-12);
}

TEST(PriorOfSets, WhatIsExpectedIsAsLikelyThereAsNot) {
  Priors priors;
  priors.expected = {"ligament", "adhesion"};
  EXPECT_NEAR(std::exp(priors.ln_of_set(effects, {})), 0.25 * 0.5, 1e-12);
  EXPECT_NEAR(std::exp(priors.ln_of_set(effects, {0, 1})), 0.25 * 0.5, 1e-12);
  EXPECT_NEAR(std::exp(priors.ln_of_set(effects, {1, 4})), 0.25 * 0.3 / 15, 1e-12);
  EXPECT_EQ(priors.of_effect(effects, "adhesion"), 0.5);
  EXPECT_NEAR(priors.of_effect(effects, "friction"), (0.3 * 1 + 0.15 * 2 + 0.05 * 3) / 15, 1e-12);
}

TEST(Decide, WhatIsExpectedAndLeftOpenIsToldApartFromNothingElse) {
  Priors priors;
  priors.expected = {"ligament", "adhesion"};
  const auto decided = [&](const std::vector<Hypothesis>& list) {
    return decide(list, effects, inclusions(list, effects, priors), little, priors, {});
  };
  // Both tell the same story, a third one less well: neither has a Bayes factor of 3.
  const Diagnosis open = decided(hypotheses({{{0}, 0.4}, {{1}, 0.3}, {{2}, 0.1}}));
  EXPECT_EQ(open.verdict, Verdict::ambiguous);
  EXPECT_EQ(open.missing, (Names{"ligament", "adhesion"}));
  const Diagnosis found = decided(hypotheses({{{0}, 0.7}, {{0, 1}, 0.29}}));
  EXPECT_EQ(found.missing, Names{"ligament"});
  EXPECT_EQ(found.ambiguous_rest, Names{"adhesion"});
  const Diagnosis likelier = decided(hypotheses({{{0}, 0.6}}));
  EXPECT_EQ(likelier.verdict, Verdict::ambiguous);
  EXPECT_EQ(likelier.missing, Names{"ligament"});
  EXPECT_EQ(decided(hypotheses({{{0}, 0.45}})).verdict, Verdict::nothing_missing);
}

TEST(Decide, WhatIsExpectedAndCannotBeSeenIsNotCalledAbsent) {
  Priors priors;
  priors.expected = {"ligament"};
  const auto decided = [&](double probability, const Names& unseen) {
    const auto list = hypotheses({{{0}, probability}});
    return decide(list, effects, inclusions(list, effects, priors), little, priors, unseen);
  };
  const Diagnosis blind = decided(0.2, {"ligament"});
  EXPECT_EQ(blind.verdict, Verdict::ambiguous);
  EXPECT_EQ(blind.missing, Names{"ligament"});
  EXPECT_NE(blind.why.find("could not show ligament"), std::string::npos) << blind.why;
  EXPECT_EQ(decided(0.2, {"adhesion"}).verdict, Verdict::nothing_missing) << "nobody expects it";
  const Diagnosis looked_for = decided(0.2, {});
  EXPECT_EQ(looked_for.verdict, Verdict::nothing_missing);
  EXPECT_EQ(looked_for.ambiguous_rest, Names{"ligament"}) << "a small one may be there all the same";
  EXPECT_TRUE(decided(0.01, {}).ambiguous_rest.empty());
  EXPECT_EQ(decided(0.01, {"ligament"}).verdict, Verdict::nothing_missing) << "excluded";
}

}  // namespace
}  // namespace supine::diagnosis
