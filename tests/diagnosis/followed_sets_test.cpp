// SPDX-License-Identifier: AGPL-3.0-or-later
// Sets of effects followed through the chain, on twins.
#include "diagnosis/followed_sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "diagnosis/beside.h"
#include "diagnosis/look_beside.h"
#include "diagnosis/parts_of_first.h"
#include "diagnosis/range_ends.h"
#include "tests/diagnosis/twin_findings.h"

namespace supine::diagnosis {
namespace {

TEST(TwinDiagnosis, LinesFromItsUsualSizeShowMoreOfALigamentThanLinesFromNothing) {
  const Twin twin({twin_with("ligament", "stiffness_kpa_per_mm", 2.0), twin_noise_mm});
  const Subject subject = subject_of(twin);
  const auto found = findings_of(subject, 0);
  const int ligament = row_of(*found, "ligament");
  const auto single = [ligament](const std::vector<Hypothesis>& list) {
    return *std::find_if(list.begin(), list.end(),
                         [ligament](const Hypothesis& h) { return h.effects == std::vector{ligament}; });
  };
  std::vector<Hypothesis> list = found->hypotheses;
  weigh_from_usual_size(subject.scene, subject.given, found->base, found->candidates, {}, list);
  const Hypothesis before = single(found->hypotheses), after = single(list);
  EXPECT_TRUE(after.from_usual);
  EXPECT_FALSE(after.refitted);
  EXPECT_GT(after.probability, before.probability);
  Refit followed = refit(subject.scene, subject.given, found->base, found->base, found->candidates, after);
  ASSERT_TRUE(followed.solved);
  EXPECT_LT(std::abs(after.ln_evidence - followed.hypothesis.ln_evidence),
            0.5 * std::abs(before.ln_evidence - followed.hypothesis.ln_evidence));
  // Laplace's formula and the curve of the strength tell of one body: no end of the curve makes evidence of its own.
  const std::vector<FittedParameter> by_laplace = followed.parameters;
  const double gain = find_strength_densities(subject.scene, found->candidates, followed);
  EXPECT_NEAR(gain, 0, 5);
  EXPECT_EQ(followed.hypothesis.ln_evidence, followed.hypothesis.weighed.ln_evidence + gain);
  EXPECT_GT(followed.parameters.at(0).high, by_laplace.at(0).high) << "a ligament saturates: its upper end is long";
  EXPECT_EQ(find_strength_densities(subject.scene, found->candidates, followed), 0) << "once is enough";
}

TEST(Refit, AnEffectDoesNothingWhereAllItsStrengthsMayBeWhatTheyAreWithoutIt) {
  Candidate tilt;
  for (const char* name : {"gravity_tilt.roll_rad", "gravity_tilt.pitch_rad"})
    tilt.parameters.emplace_back().name = name, tilt.parameters.back().null = 0;
  Refit refit;
  refit.parameters = {{"gravity_tilt.roll_rad", "rad", 0.01, -0.02, 0.04},
                      {"breast.young_modulus_kpa", "kPa", 1, 0.5, 2}};
  EXPECT_FALSE(does_nothing(refit, tilt)) << "one of its numbers was not fitted";
  refit.parameters.push_back({"gravity_tilt.pitch_rad", "rad", -0.01, -0.03, 0.01});
  EXPECT_TRUE(does_nothing(refit, tilt));
  refit.parameters.back().high = -0.001;
  EXPECT_FALSE(does_nothing(refit, tilt));
}

TEST(Refit, APartOfASetIsFoundFromWhereTheWholeEnded) {
  const Twin twin({twin_with("chest_wall_motion", "amplitude_mm", 6), twin_noise_mm});
  const Subject subject = subject_of(twin);
  const auto found = findings_of(subject, 0);
  const int hill = row_of(*found, "chest_wall_motion"), idle = row_of(*found, "incompressibility");
  const auto set = [&](std::vector<int> which) {
    std::sort(which.begin(), which.end());
    return *std::find_if(found->hypotheses.begin(), found->hypotheses.end(),
                         [&which](const Hypothesis& h) { return h.effects == which; });
  };
  const Refit whole =
      refit(subject.scene, subject.given, found->base, found->base, found->candidates, set({hill, idle}));
  ASSERT_TRUE(whole.solved);
  EXPECT_FALSE(does_nothing(whole, found->candidates[static_cast<std::size_t>(hill)]));
  const Refit alone = refit(subject.scene, subject.given, found->base, found->base, found->candidates, set({hill}));
  const Refit within = refit_within(subject.scene, subject.given, found->base, whole, found->candidates, set({hill}));
  ASSERT_TRUE(within.solved);
  EXPECT_EQ(within.effects, std::vector<std::string>{"chest_wall_motion"});
  EXPECT_LT(whole.joint.nuisances.size(), alone.joint.nuisances.size());
  EXPECT_EQ(within.joint.nuisances.size(), alone.joint.nuisances.size()) << "what the idle effect had replaced is back";
  EXPECT_NEAR(within.hypothesis.ln_evidence, alone.hypothesis.ln_evidence, 1);
  EXPECT_NEAR(within.parameters.at(0).value, alone.parameters.at(0).value, 0.5);
}

/// A hill that the model lacks, and beside it an effect that does nothing.
class HillAndIdle : public ::testing::Test {
 protected:
  HillAndIdle() { std::sort(both.begin(), both.end()); }

  const Twin twin{{twin_with("chest_wall_motion", "amplitude_mm", 6), twin_noise_mm}};
  const Subject subject = subject_of(twin);
  const std::unique_ptr<Findings> found = findings_of(subject, 0);
  const ExamineOptions options = twin_options(5);
  FollowedSets sets{subject, options, *found};
  const int hill = row_of(*found, "chest_wall_motion"), idle = row_of(*found, "incompressibility");
  std::vector<int> both{hill, idle};
};

TEST_F(HillAndIdle, WhatWasMeasuredBesideAnEffectThatDoesNothingIsDroppedWithIt) {
  for (const std::vector<int>& set : {{hill}, {idle}, both}) sets.follow_one(set);
  ASSERT_EQ(found->hypotheses.front().effects, std::vector{hill});
  EXPECT_FALSE(do_without_idle(sets)) << "the hill does something";
  // As if the idle one had been sure before the hill was found.
  constexpr double once_sure = 10;
  found->beside.push_back({{idle},
                           ground_beside(subject.scene, found->base, sets.refit_of({idle})->joint, found->priors),
                           idle,
                           once_sure,
                           0});
  const BaseFit* beside = found->beside.back().ground.get();
  for (const std::vector<int>& set : {{idle}, both}) {
    Refit& refit = *sets.refit_of(set);
    refit = refit_again(subject.scene, *beside, refit);
    ASSERT_TRUE(refit.solved);
    sets.hypothesis_of(set) = refit.hypothesis;
  }
  std::erase_if(found->hypotheses,
                [&](const Hypothesis& h) { return is_part_of({idle}, h.effects) && h.ground != beside; });
  sets.weigh();
  ASSERT_EQ(found->hypotheses.front().effects, both);
  EXPECT_TRUE(do_without_idle(sets));
  EXPECT_TRUE(found->beside.empty());
  ASSERT_EQ(found->dropped.size(), 1u);
  EXPECT_EQ(found->dropped.front().ground.get(), beside);
  EXPECT_EQ(found->hypotheses.front().effects, std::vector{hill});
  for (const Hypothesis& h : found->hypotheses) EXPECT_EQ(h.ground, &found->base);
  const auto under_others = [this](const Refit& refit) {
    return refit.solved && refit.hypothesis.ground != &found->base;
  };
  EXPECT_TRUE(std::none_of(found->refits.begin(), found->refits.end(), under_others));
  EXPECT_FALSE(do_without_idle(sets));
}

TEST_F(HillAndIdle, LinesBackFromTheHillPromiseWhatNothingIs) {
  sets.follow_one({hill});
  const double with = sets.hypothesis_of({hill}).ln_evidence, without = sets.hypothesis_of({}).ln_evidence;
  ASSERT_GT(with - without, 20);
  EXPECT_NEAR(promised_without(*sets.refit_of({hill}), found->candidates[static_cast<std::size_t>(hill)]), without,
              0.25 * (with - without));
}

TEST_F(HillAndIdle, APartThatEndedElsewhereIsFollowedFromTheWhole) {
  for (const std::vector<int>& set : {{hill}, both}) sets.follow_one(set);
  const double well = sets.hypothesis_of({hill}).ln_evidence;
  constexpr double elsewhere = 15;
  sets.hypothesis_of({hill}).ln_evidence -= elsewhere;
  sets.refit_of({hill})->hypothesis.ln_evidence -= elsewhere;
  sets.weigh();
  ASSERT_EQ(found->hypotheses.front().effects, both);
  std::vector<std::vector<int>> looked_at;
  follow_parts_of_first(sets, looked_at);
  EXPECT_EQ(looked_at, std::vector<std::vector<int>>(1, both));
  EXPECT_EQ(found->hypotheses.front().effects, std::vector{hill});
  EXPECT_NEAR(sets.hypothesis_of({hill}).ln_evidence, well, 1);
  const auto is_of_hill = [this](const Refit& refit) { return refit.hypothesis.effects == std::vector{hill}; };
  EXPECT_EQ(std::count_if(found->refits.begin(), found->refits.end(), is_of_hill), 1) << "of two fits one is kept";
}

TEST(Follow, NothingIsFollowedAgainFromWhereALikelyEffectEnded) {
  const Twin twin({supine::testing::twin_truth(), twin_noise_mm});
  const Subject subject = subject_of(twin);
  const auto found = findings_of(subject, 0);
  std::vector<std::string> told;
  ExamineOptions options = twin_options(5);
  options.progress = [&told](const std::string& what) { told.push_back(what); };
  FollowedSets sets(subject, options, *found);
  sets.follow_one({row_of(*found, "adhesion")});
  told.clear();
  follow_nothing_again(sets);
  EXPECT_TRUE(told.empty()) << "it came out better";
  const double well = sets.hypothesis_of({}).ln_evidence, likely = sets.hypothesis_of({}).probability;
  constexpr double elsewhere = 3;
  sets.hypothesis_of({}).ln_evidence -= elsewhere;
  sets.weigh();
  ASSERT_LT(sets.hypothesis_of({}).probability, likely);
  follow_nothing_again(sets);
  EXPECT_EQ(told, std::vector<std::string>{"from an effect, nothing again: without adhesion"});
  EXPECT_NEAR(sets.hypothesis_of({}).ln_evidence, well, 0.5);
  EXPECT_NEAR(sets.hypothesis_of({}).probability, likely, 0.05);
  EXPECT_EQ(found->refits.size(), 1u) << "nothing is no refit";
  told.clear();
  sets.hypothesis_of({}).ln_evidence -= elsewhere;
  sets.weigh();
  follow_nothing_again(sets);
  EXPECT_TRUE(told.empty()) << "it was followed from there";
}

TEST(Follow, NothingIsFollowedAgainWhereLinesBackFromAnEffectPromiseItHoweverLikelyTheEffectIs) {
  const Twin twin({supine::testing::twin_truth(), twin_noise_mm});
  const Subject subject = subject_of(twin);
  const auto found = findings_of(subject, 0);
  FollowedSets sets(subject, twin_options(5), *found);
  const int effect = row_of(*found, "friction");
  sets.follow_one({effect});
  const double well = sets.hypothesis_of({}).ln_evidence;
  constexpr double elsewhere = 50;
  sets.hypothesis_of({}).ln_evidence -= elsewhere;
  sets.weigh();
  ASSERT_LT(sets.hypothesis_of({}).probability, 1e-6);
  follow_nothing_again(sets);
  EXPECT_NEAR(sets.hypothesis_of({}).ln_evidence, well, 0.5);
}

TEST(Follow, ANameThatErrorsMeasuredBesideItMakeLightOfIsTakenBack) {
  const Twin twin({supine::testing::twin_truth(), twin_noise_mm});
  const Subject subject = subject_of(twin);
  const auto found = findings_of(subject, 0);
  constexpr double too_small = 0.08;  // noise stands out then
  BaseFit& base = found->base;
  base.errors *= too_small;
  base.covariance = std::make_unique<ErrorCovariance>(base.errors, base.kernel, base.scale_mm, base.most_mm);
  found->priors.named_at = 0.9;
  found->hypotheses = Screening(base, found->candidates, found->priors).hypotheses();
  FollowedSets sets(subject, twin_options(5), *found);
  int likeliest = 0;
  for (int e = 0; e < static_cast<int>(found->candidates.size()); ++e)
    if (sets.hypothesis_of({e}).probability > sets.hypothesis_of({likeliest}).probability) likeliest = e;
  sets.follow_one({likeliest});
  ASSERT_GT(inclusion(found->hypotheses, likeliest), found->priors.named_at);
  const double odds = ln_odds_of(found->hypotheses, {likeliest});
  look_beside(sets);
  ASSERT_FALSE(found->beside.empty());
  EXPECT_EQ(found->beside.front().effects, std::vector{likeliest});
  EXPECT_LT(found->beside.front().ln_odds, odds - 1);
  EXPECT_LT(inclusion(found->hypotheses, likeliest), found->priors.named_at);
}

TEST(Follow, NothingIsNotAskedAgainWhereItIsOutOfTheQuestion) {
  const Twin twin({twin_with("chest_wall_motion", "amplitude_mm", 6), twin_noise_mm});
  const Subject subject = subject_of(twin);
  const auto found = findings_of(subject, 0);
  std::vector<std::string> told;
  ExamineOptions options = twin_options(5);
  options.progress = [&told](const std::string& what) { told.push_back(what); };
  FollowedSets sets(subject, options, *found);
  sets.follow_one({row_of(*found, "chest_wall_motion")});
  told.clear();
  follow_nothing_again(sets);
  EXPECT_TRUE(told.empty());
}

TEST(Follow, AScanThatLiesFarOffIsPutInItsPlaceFirst) {
  const Twin twin({supine::testing::twin_truth(), twin_noise_mm});
  const auto first_told = [&twin](const Eigen::RowVector3d& shift_mm) {
    Subject subject = subject_of(twin);
    const calibration::Measurement moved = scan_elsewhere(twin, shift_mm);
    subject.scene.measurements = {&moved};
    ExamineOptions options = twin_options(1);
    options.priors.known.registration_mm = 0.3, options.priors.known.registration_rad = 0.004;
    std::vector<std::string> told;
    options.progress = [&told](const std::string& what) { told.push_back(what); };
    const auto found = examine(subject, options);
    const auto refit =
        std::find_if(told.begin(), told.end(), [](const auto& s) { return s.starts_with("refit with"); });
    const bool usual = std::find(told.begin(), refit, "lines from usual sizes") != refit;
    return std::tuple(refit == told.end() ? "" : *refit, usual, names(found->diagnosis, "misregistration"));
  };
  EXPECT_EQ(first_told({2.5, -2.5, 1.5}), std::tuple(std::string("refit with misregistration"), false, true));
  const auto [first, usual, named] = first_told({0.2, -0.3, 0.1});
  EXPECT_NE(first, "refit with misregistration");
  EXPECT_FALSE(named);
}

TEST(Refit, SaysThatAPlaceEndsAtTheBorderOfItsRange) {
  const auto ends_there = [](double centre) {
    simulation::Model truth = twin_with("chest_wall_motion", "amplitude_mm", 8);
    truth.effects[0].parameters.at("centre_lateral").value = centre;
    const Twin twin({truth, twin_noise_mm});
    const Subject subject = subject_of(twin);
    const auto found = findings_of(subject, 0);
    const int hill = row_of(*found, "chest_wall_motion");
    for (const Hypothesis& h : found->hypotheses)
      if (h.effects == std::vector{hill})
        return refit(subject.scene, subject.given, found->base, found->base, found->candidates, h).at_border;
    return false;
  };
  EXPECT_TRUE(ends_there(0.55));
  EXPECT_FALSE(ends_there(0.2));
}

}  // namespace
}  // namespace supine::diagnosis
