// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include "diagnosis/diagnose.h"

namespace supine::diagnosis {
namespace {

using Names = std::vector<std::string>;

ScoreTable table_with(double p) {
  Score score{};
  score.effect = "ligament", score.p_value = p;
  return {{score}, 1.3, 1.4, 100, 0, {}, {}};
}

Refit refit(const std::string& effect, double bic, double held_out, std::vector<double> poses = {}) {
  Refit r;
  r.effect = effect, r.solved = r.finished = true, r.bic = bic, r.held_out_rms_mm = held_out;
  r.pose_rms_mm = std::move(poses);
  return r;
}

const LackOfFit real_left{3, 1e-9}, nothing_left{1, 0.4};

BaseFigures base_figures(const LackOfFit& left) { return {1.3, 1.4, 0.7, {}, left}; }

Diagnosis verdict(const std::vector<Refit>& refits, const LackOfFit& after = nothing_left, double p = 0.001) {
  return decide(table_with(p), refits, std::vector<LackOfFit>(refits.size(), after), base_figures(real_left));
}

TEST(Decide, NamesTheOneThatStandsOut) {
  const Diagnosis d = verdict({refit("ligament", 60, 0.8), refit("adhesion", 20, 0.95)});
  EXPECT_EQ(d.verdict, Verdict::missing);
  EXPECT_EQ(d.missing, Names{"ligament"});
}

TEST(Decide, WhatCannotBeToldFromNothingIsNotNamed) {
  EXPECT_EQ(verdict({refit("ligament", 5, 0.8)}).verdict, Verdict::unexplained);
  EXPECT_EQ(verdict({refit("ligament", 7, 0.8)}).verdict, Verdict::missing);
}

TEST(Decide, NamesAllThatDoAsWellMeasurementFirst) {
  const Diagnosis d = verdict({refit("adhesion", 60, 0.8), refit("misregistration", 57, 0.8)});
  EXPECT_EQ(d.verdict, Verdict::ambiguous);
  EXPECT_EQ(d.missing, (Names{"misregistration", "adhesion"}));
}

/// A scan of another pose that was not fitted, at @p pose_mm with the effect.
Refit seen_elsewhere(Refit r, double gain, double pose_mm) {
  r.pose_gain = gain;
  r.pose_rms_mm = {pose_mm};
  return r;
}

BaseFigures with_unfitted_pose(const LackOfFit& left) {
  BaseFigures base = base_figures(left);
  base.pose_rms_mm = {1.0};  // 0.51 mm² above the noise
  base.unfitted_poses = 1;
  return base;
}

TEST(Decide, APoseThatWasNotFittedHasItsSay) {
  const BaseFigures base = with_unfitted_pose(real_left);
  const auto of_two = [&base](double gain_of_adhesion, double gain_of_ligament) {
    return decide(table_with(0.001),
                  {seen_elsewhere(refit("adhesion", 40, 0.8), gain_of_adhesion, 0.8),
                   seen_elsewhere(refit("ligament", 20, 0.8), gain_of_ligament, 0.8)},
                  {nothing_left, nothing_left}, base)
        .missing;
  };
  EXPECT_EQ(of_two(5, 5), Names{"adhesion"});
  EXPECT_EQ(of_two(-20, 25), Names{"ligament"});
  EXPECT_EQ(of_two(-20, 2), (Names{"ligament", "adhesion"})) << "20 and 22";
  EXPECT_EQ(of_two(40, 1000), Names{"adhesion"}) << "at most twice what the fitted pose says";
}

TEST(Decide, AnUnfittedPoseThatComesOutFurtherOffSpeaksForNothing) {
  const BaseFigures base = with_unfitted_pose(real_left);
  const auto with = [&base](double bic, double gain, double pose_mm) {
    return decide(table_with(0.001), {seen_elsewhere(refit("ligament", bic, 1.8), gain, pose_mm)}, {nothing_left}, base)
        .verdict;
  };
  EXPECT_EQ(with(4, 5, 0.9), Verdict::missing) << "another scan is proof of another kind";
  EXPECT_EQ(with(4, 5, 1.1), Verdict::unexplained);
  EXPECT_EQ(with(4, -1, 0.9), Verdict::missing) << "37 % of what it has above the noise";
  EXPECT_EQ(with(4, -1, 0.97), Verdict::unexplained) << "12 %";
  EXPECT_EQ(with(15, 5, 1.01), Verdict::missing) << "where it hardly shows it has no say";
  EXPECT_EQ(with(15, -1, 0.9), Verdict::missing);
  EXPECT_EQ(with(15, -3, 0.9), Verdict::unexplained) << "or against it";
  EXPECT_EQ(with(60, -30, 1.1), Verdict::missing) << "unless the fitted one says far more";
  EXPECT_EQ(with(60, -50, 1.1), Verdict::unexplained);
  EXPECT_EQ(with(1, 50, 0.8), Verdict::unexplained) << "nothing in the fitted pose";
  const auto without_equilibrium = [&base](double bic) {
    return decide(table_with(0.001), {refit("ligament", bic, 0.8)}, {nothing_left}, base).verdict;
  };
  EXPECT_EQ(without_equilibrium(15), Verdict::unexplained);
  EXPECT_EQ(without_equilibrium(30), Verdict::missing);
}

TEST(Decide, SkinAndAnotherScanTogetherNameWhatStandsOutALittle) {
  const BaseFigures base = with_unfitted_pose(nothing_left);
  const auto with = [&base](double p, double bic, double gain, double held_out_mm, double pose_mm) {
    const Refit r = seen_elsewhere(refit("ligament", bic, held_out_mm), gain, pose_mm);
    return decide(table_with(p), {r}, {nothing_left}, base).verdict;
  };
  EXPECT_EQ(with(0.03, 4, 4, 1.2, 0.9), Verdict::missing);
  EXPECT_EQ(with(0.06, 4, 4, 1.2, 0.9), Verdict::nothing_missing) << "p";
  EXPECT_EQ(with(0.03, 1, 2, 1.2, 0.9), Verdict::nothing_missing) << "BIC";
  EXPECT_EQ(with(0.03, 4, 1, 1.2, 0.9), Verdict::nothing_missing) << "evidence";
  EXPECT_EQ(with(0.03, 4, 4, 1.39, 0.9), Verdict::nothing_missing) << "skin";
  EXPECT_EQ(with(0.03, 4, 4, 1.2, 0.97), Verdict::nothing_missing) << "the other scan";
  EXPECT_EQ(with(0.03, 7, 7, 1.5, 0.97), Verdict::missing) << "each scan by itself, whatever blocks of skin show";
  EXPECT_EQ(with(0.03, 7, 5, 1.5, 0.97), Verdict::nothing_missing);
}

TEST(Decide, WhatSkinLeftOutAndAnotherScanShowEachNeedsNoPWhereMoreIsLeftThanErrorsLeave) {
  const auto with = [](double left_p, double bic, double gain, double held_out_mm) {
    const Refit r = seen_elsewhere(refit("chest_wall_motion", bic, held_out_mm), gain, 0.8);
    return decide(table_with(0.07), {r}, {nothing_left}, with_unfitted_pose({1.15, left_p}));
  };
  const Diagnosis shown = with(1e-4, 17, 60, 1.2);
  EXPECT_EQ(shown.verdict, Verdict::missing);
  EXPECT_NE(shown.why.find("its score does not"), std::string::npos) << shown.why;
  EXPECT_EQ(with(0.02, 17, 60, 1.2).verdict, Verdict::nothing_missing) << "errors leave as much";
  EXPECT_EQ(with(1e-4, 5, 60, 1.2).verdict, Verdict::nothing_missing) << "b";
  EXPECT_EQ(with(1e-4, 17, 5, 1.2).verdict, Verdict::nothing_missing) << "the other scan";
  EXPECT_EQ(with(1e-4, 17, 60, 1.38).verdict, Verdict::nothing_missing) << "skin left out";
}

TEST(Decide, WhatAnotherScanHasAboveTheNoiseIsAboveItsOwn) {
  BaseFigures base = with_unfitted_pose(real_left);
  base.pose_rms_mm = {1.6};
  const auto verdict_of = [&base] {
    return decide(table_with(0.001), {seen_elsewhere(refit("ligament", 4, 1.8), -1, 1.55)}, {nothing_left}, base)
        .verdict;
  };
  EXPECT_EQ(verdict_of(), Verdict::unexplained) << "8 % of what is above 0.7 mm";
  base.pose_noise_mm = {1.5};
  EXPECT_EQ(verdict_of(), Verdict::missing) << "half of what is above 1.5 mm";
}

TEST(Decide, DoesNotNameWhatTheHeldOutErrorDoesNotConfirm) {
  constexpr double p = 0.03;  // not low enough to name anything by itself
  const Diagnosis d = verdict({refit("ligament", 60, 1.39)}, nothing_left, p);
  EXPECT_EQ(d.verdict, Verdict::unexplained);
  EXPECT_EQ(d.missing, Names{"ligament"});
  const auto unconfirmed = [](double bic) {
    return decide(table_with(p), {refit("ligament", bic, 1.39)}, {nothing_left}, base_figures(nothing_left)).verdict;
  };
  EXPECT_EQ(unconfirmed(15), Verdict::nothing_missing);
  EXPECT_EQ(unconfirmed(60), Verdict::unexplained) << "something is there";
}

TEST(Decide, ALowPNamesWhatLiesUnderOneBlockOfSkinAlone) {
  EXPECT_EQ(verdict({refit("ligament", 60, 1.8)}).verdict, Verdict::missing);
  EXPECT_EQ(verdict({refit("ligament", 60, 1.8)}, nothing_left, 0.03).verdict, Verdict::unexplained) << "p";
  EXPECT_EQ(verdict({refit("ligament", 4, 1.8)}).verdict, Verdict::unexplained) << "BIC";
}

TEST(Decide, AFittedPoseLeftOutHasToConfirmIt) {
  BaseFigures base = base_figures(real_left);
  base.pose_rms_mm = {1.0};
  const auto with_pose = [&base](double pose, double bic = 15) {
    return decide(table_with(0.001), {refit("ligament", bic, 1.8, {pose})}, {nothing_left}, base).verdict;
  };
  EXPECT_EQ(with_pose(0.98), Verdict::missing);
  EXPECT_EQ(with_pose(0.99), Verdict::unexplained) << "of 1.0 mm 0.51 mm² are above the noise";
  EXPECT_EQ(with_pose(1.1), Verdict::unexplained);
  EXPECT_EQ(with_pose(0.99, 60), Verdict::unexplained) << "however well the fitted pose fits";
  EXPECT_EQ(with_pose(0.9, 4), Verdict::missing) << "a pose that was not fitted is proof of another kind";
  EXPECT_EQ(with_pose(0.96, 4), Verdict::unexplained) << "which has to be strong where the fitted pose is weak";
  EXPECT_EQ(with_pose(0.9, 1), Verdict::unexplained);
}

TEST(Decide, WhatLeavesAResidualHasToShowMoreInTheUnfittedPose) {
  BaseFigures base = with_unfitted_pose(real_left);
  const auto with_pose = [&base](double pose, const LackOfFit& after) {
    return decide(table_with(0.001), {seen_elsewhere(refit("ligament", 60, 0.8), 10, pose)}, {after}, base);
  };
  EXPECT_EQ(with_pose(0.95, {1.2, 0.4}).verdict, Verdict::missing);
  EXPECT_EQ(with_pose(0.9, {1.2, 1e-4}).verdict, Verdict::missing);
  EXPECT_EQ(with_pose(0.95, {1.05, 1e-4}).verdict, Verdict::missing) << "next to nothing is left";
  const Diagnosis half = with_pose(0.95, {1.2, 1e-4});
  EXPECT_EQ(half.verdict, Verdict::unexplained);
  EXPECT_EQ(half.missing, Names{"ligament"});
  EXPECT_NE(half.why.find("takes away 19 % of what scans that were not fitted have"), std::string::npos) << half.why;
  base.unfitted_poses = 0;
  EXPECT_EQ(with_pose(0.95, {1.2, 1e-4}).verdict, Verdict::missing) << "fitted, left out in one linear step";
}

TEST(Decide, WhatLeavesAResidualHasToShowMoreInTheSkinLeftOut) {
  const auto with_skin = [](double held_out_mm, const LackOfFit& after) {
    return verdict({refit("ligament", 60, held_out_mm)}, after);
  };
  const LackOfFit some{1.3, 1e-4};  // of the 1.4 mm 1.47 mm² are above the noise
  EXPECT_EQ(with_skin(1.2, some).verdict, Verdict::missing);
  EXPECT_EQ(with_skin(1.3, {1.3, 0.4}).verdict, Verdict::missing) << "chance leaves as much";
  EXPECT_EQ(with_skin(1.3, {1.05, 1e-4}).verdict, Verdict::missing) << "next to nothing is left";
  EXPECT_EQ(with_skin(1.3, some).verdict, Verdict::unexplained);
  const Diagnosis worse = with_skin(1.6, some);
  EXPECT_EQ(worse.verdict, Verdict::unexplained);
  EXPECT_EQ(worse.missing, Names{"ligament"});
  EXPECT_NE(worse.why.find("does not bring blocks of skin left out nearer"), std::string::npos) << worse.why;
}

TEST(Decide, AnotherPoseDoesNotMakeUpForSkinThatDoesNotShowIt) {
  const Refit r = seen_elsewhere(refit("ligament", 60, 1.6), 130, 0.8);
  const auto with = [&r](const LackOfFit& after) {
    return decide(table_with(0.001), {r}, {after}, with_unfitted_pose(real_left)).verdict;
  };
  EXPECT_EQ(with({1.3, 1e-4}), Verdict::unexplained);
  EXPECT_EQ(with({1.05, 1e-4}), Verdict::missing);
}

TEST(Decide, BlocksOfSkinAreNotBelievedWhereAnotherPoseDoesNotShowIt) {
  BaseFigures base = base_figures(nothing_left);
  base.pose_rms_mm = {0.87};
  const auto with_pose = [&base](double pose) {
    return decide(table_with(0.001), {refit("ligament", 15, 1.1, {pose})}, {nothing_left}, base).verdict;
  };
  EXPECT_EQ(with_pose(0.84), Verdict::missing);
  EXPECT_EQ(with_pose(0.87), Verdict::nothing_missing);
}

TEST(Decide, AScanThatLiesElsewhereIsNotJudgedByAnotherScan) {
  BaseFigures base = base_figures(real_left);
  base.pose_rms_mm = {1.0};
  const Refit shifted = refit("misregistration", 60, 1.8, {1.3});
  ScoreTable table = table_with(0.001);
  table.scores[0].effect = "misregistration";
  base.unfitted_poses = 1;
  EXPECT_EQ(decide(table, {shifted}, {nothing_left}, base).verdict, Verdict::missing);
  base.unfitted_poses = 0;  // fitted with one shift for both: each must show the other's
  EXPECT_EQ(decide(table, {shifted}, {nothing_left}, base).verdict, Verdict::unexplained);
}

TEST(Decide, WhatComesNearIsARivalWhetherItCountsOrNot) {
  const Diagnosis d = verdict({refit("ligament", 20, 1.39), refit("segmentation_offset", 16, 1.39)});
  EXPECT_EQ(d.verdict, Verdict::ambiguous);
  EXPECT_EQ(d.missing, (Names{"segmentation_offset", "ligament"}));
}

TEST(Decide, NamesNothingByChance) {
  const auto d = decide(table_with(0.2), {refit("ligament", 60, 0.8)}, {nothing_left}, base_figures(nothing_left));
  EXPECT_EQ(d.verdict, Verdict::nothing_missing);
  EXPECT_TRUE(d.missing.empty());
}

TEST(Decide, TheBestThatLeavesARealResidualIsNamedAsNoMoreThanThat) {
  const Diagnosis d = verdict({refit("ligament", 60, 1.0), refit("adhesion", 58, 1.0)}, real_left);
  EXPECT_EQ(d.verdict, Verdict::unexplained);
  EXPECT_EQ(d.missing, Names{"ligament"});
  EXPECT_GT(d.left.misfit, 2);
}

TEST(Decide, WhatWouldHaveToBeElsewhereThanItCanBeIsNotNamed) {
  Refit steep = refit("chest_wall_motion", 60, 0.8);
  steep.at_border = true;
  EXPECT_EQ(verdict({steep}).verdict, Verdict::unexplained);
  const Diagnosis beside = verdict({steep, refit("ligament", 20, 0.8)});
  EXPECT_EQ(beside.verdict, Verdict::ambiguous) << "a rival still";
  EXPECT_EQ(beside.missing, (Names{"ligament", "chest_wall_motion"}));
}

TEST(Decide, ARefitThatWasGivenUpEarlyIsNotNamed) {
  Refit early = refit("ligament", 60, 0.8);
  early.finished = false;
  EXPECT_EQ(verdict({early, refit("adhesion", 20, 0.8)}).missing, Names{"adhesion"});
}

}  // namespace
}  // namespace supine::diagnosis
