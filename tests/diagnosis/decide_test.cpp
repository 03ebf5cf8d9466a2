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
  return decide(list, effects, included, left, priors);
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
  EXPECT_DOUBLE_EQ(std::exp(ln_prior_of_set(priors, 17, 0)), 0.5);
  EXPECT_NEAR(std::exp(ln_prior_of_set(priors, 17, 2)), 0.15 / 136, 1e-12);
  EXPECT_NEAR(std::exp(ln_prior_of_set(priors, 17, 3)), 0.05 / 680, 1e-12);
}

}  // namespace
}  // namespace supine::diagnosis
