// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/other_priors.h"

#include <gtest/gtest.h>

namespace supine::diagnosis {
namespace {

/// Twenty distances, one effect that changes all of them alike, and "nothing".
struct Sheet {
  static constexpr Eigen::Index points = 20;
  BaseFit base;
  std::vector<std::string> effects = {"ligament"};
  std::vector<Hypothesis> hypotheses;
  std::vector<Inclusion> included;
  Priors priors;

  explicit Sheet(double seen_mm) {
    base.errors = 0.25 * Eigen::MatrixXd::Identity(points, points);
    base.kernel = Eigen::MatrixXd::Identity(points, points);
    base.scale_mm = 0.05, base.most_mm = 10;
    base.covariance = std::make_unique<ErrorCovariance>(base.errors, base.kernel, base.scale_mm, base.most_mm);
    Directions all;
    all.add("ligament.stiffness_kpa_per_mm", Eigen::VectorXd::Ones(points), 0, 2);
    const auto evidence =
        std::make_shared<LinearEvidence>(*base.covariance, Eigen::VectorXd::Constant(points, seen_mm), all);
    for (const bool with : {false, true}) {
      Hypothesis h;
      if (with) h.effects = {0}, h.rows = {0};
      h.evidence = evidence;
      h.ground = &base;
      h.weighed = evidence->weigh(h.rows);
      h.ln_evidence = h.weighed.ln_evidence;
      h.ln_prior = std::log(0.5);
      hypotheses.push_back(h);
    }
    normalise(hypotheses);
    included = inclusions(hypotheses, effects, priors);
  }

  std::vector<OtherPrior> others() const { return under_other_priors(hypotheses, effects, included, {}, priors, {}); }
};

/// The least misfit that names the effect.
Sheet just_named() {
  double seen_mm = 0.2;
  while (Sheet(seen_mm).included.front().probability < 0.955) seen_mm += 0.002;
  return Sheet(seen_mm);
}

TEST(OtherPriors, AWiderPriorChargesAnEffectForWhatItCouldHaveBeen) {
  const Sheet sheet = just_named();
  const auto others = sheet.others();
  ASSERT_EQ(others.size(), 5u);
  EXPECT_EQ(others[0].what, "strengths half as wide");
  EXPECT_EQ(others[0].diagnosis.verdict, Verdict::missing);
  EXPECT_EQ(others[1].what, "strengths twice as wide");
  EXPECT_EQ(others[1].diagnosis.verdict, Verdict::ambiguous) << "half the odds are under the level";
}

TEST(OtherPriors, ScansThatCountForHalfTakeTheRootOfABayesFactor) {
  const Sheet sheet = just_named();
  const OtherPrior half = sheet.others().back();
  EXPECT_EQ(half.what, "the scans counting for half");
  const double stated = sheet.included.front().probability, then = half.included.front().probability;
  EXPECT_NEAR(then / (1 - then), std::sqrt(stated / (1 - stated)), 1e-9) << "the prior's odds are one to one";
  EXPECT_EQ(half.diagnosis.verdict, Verdict::ambiguous);
}

TEST(OtherPriors, ScansThatCountForHalfSayHalfOfWhatIsNotListed) {
  Sheet sheet(0);
  // A bump of the skin makes nothing e⁴ likelier; without any it would be 0.9 of what it was.
  const double each = sheet.priors.unlisted / local_kinds, rest = 1 - sheet.priors.unlisted;
  const auto with_gain = [&](double gain) { return each * (std::exp(gain) + 2); };
  for (Hypothesis& h : sheet.hypotheses) {
    const double gain = h.effects.empty() ? 4 : 0, sum = rest + with_gain(gain);
    h.ln_unlisted = std::log(sum);
    h.with_unlisted = {each / sum, each * std::exp(gain) / sum, each / sum};
  }
  normalise(sheet.hypotheses);
  sheet.included = inclusions(sheet.hypotheses, sheet.effects, sheet.priors);
  const double plain =
      std::exp(sheet.hypotheses[0].effects.empty() ? sheet.hypotheses[1].ln_evidence - sheet.hypotheses[0].ln_evidence
                                                   : sheet.hypotheses[0].ln_evidence - sheet.hypotheses[1].ln_evidence);
  const double then = sheet.others().back().included.front().probability;
  EXPECT_NEAR(then / (1 - then), std::sqrt(plain) / (rest + with_gain(2)), 1e-9);
}

TEST(OtherPriors, ScansThatCountForHalfSayHalfOfErrorsMeasuredBesideAnEffect) {
  Sheet sheet = just_named();
  const double stated = sheet.included.front().probability;
  BaseFit beside;
  beside.errors = sheet.base.errors, beside.kernel = sheet.base.kernel;
  beside.scale_mm = sheet.base.scale_mm, beside.most_mm = sheet.base.most_mm;
  beside.ln_weight = 3;
  for (Hypothesis& h : sheet.hypotheses)
    if (!h.effects.empty()) h.ground = &beside;
  normalise(sheet.hypotheses);
  sheet.included = inclusions(sheet.hypotheses, sheet.effects, sheet.priors);
  const auto odds = [](double p) { return p / (1 - p); };
  const double with = sheet.included.front().probability, then = sheet.others().back().included.front().probability;
  EXPECT_NEAR(odds(with) / odds(stated), std::exp(3), 1e-6);
  EXPECT_NEAR(odds(then), std::sqrt(odds(with)), 1e-6);
}

TEST(OtherPriors, DoNotChangeWhatIsPlain) {
  for (const double seen_mm : {0.0, 1.5})
    for (const OtherPrior& other : Sheet(seen_mm).others())
      EXPECT_EQ(other.diagnosis.verdict, seen_mm > 0 ? Verdict::missing : Verdict::nothing_missing) << other.what;
}

TEST(OtherPriors, WhatWasLeftOutSpeaksAsBefore) {
  Sheet sheet(1.5);
  sheet.included.front().left_out_gain = -10;
  for (const OtherPrior& other : sheet.others()) EXPECT_EQ(other.diagnosis.verdict, Verdict::ambiguous) << other.what;
}

}  // namespace
}  // namespace supine::diagnosis
