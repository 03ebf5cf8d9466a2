// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "diagnosis/hot_spots.h"
#include "diagnosis/ladder.h"
#include "diagnosis/next_measurement.h"
#include "diagnosis/range_ends.h"
#include "tests/diagnosis/twin_findings.h"

namespace supine::diagnosis {
namespace {

class NullTwin : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    twin = new Twin({supine::testing::twin_truth(), twin_noise_mm});
    found = findings_of(*twin).release();
  }
  static void TearDownTestSuite() {
    delete found;
    delete twin;
  }
  static Twin* twin;
  static Findings* found;
};
Twin* NullTwin::twin = nullptr;
Findings* NullTwin::found = nullptr;

TEST_F(NullTwin, NothingIsMissingWhereNothingIs) {
  EXPECT_EQ(found->diagnosis.verdict, Verdict::nothing_missing) << found->diagnosis.why;
  EXPECT_LT(found->unexplained.low_mm, 0.2);
  double sum = 0;
  for (const Hypothesis& h : found->hypotheses) sum += h.probability;
  EXPECT_NEAR(sum, 1, 1e-9);
}

TEST_F(NullTwin, TheLikeliestSetsAreToldInTheirOrderAndNothingAmongThem) {
  const auto told = found->told();
  ASSERT_EQ(found->unexplained_by.size(), std::min(Findings::hypotheses_told, found->hypotheses.size()));
  ASSERT_GE(told.size(), found->unexplained_by.size());
  for (std::size_t h = 0; h < found->unexplained_by.size(); ++h) {
    EXPECT_EQ(told[h].first, &found->hypotheses[h]);
    EXPECT_EQ(told[h].second.mean_mm, found->unexplained_by[h].mean_mm);
  }
  EXPECT_TRUE(std::any_of(told.begin(), told.end(), [](const auto& one) { return one.first->effects.empty(); }));
}

TEST_F(NullTwin, TheBudgetHoldsTheNoiseAndWhatIsUnexplained) {
  EXPECT_NEAR(found->budget.noise, twin_noise_mm, 0.05);
  EXPECT_NEAR(found->budget.total, found->rms_mm, 1e-12);
  EXPECT_EQ(found->budget.model_form, found->unexplained.mean_mm);
  // What places and moduli leave to doubt once this scan is fitted: less than it errs, more than nothing.
  for (const double doubt : {found->budget.registration, found->budget.parameters}) {
    EXPECT_GT(doubt, 0.005);
    EXPECT_LT(doubt, twin_noise_mm);
  }
}

TEST_F(NullTwin, AScanThatLiesElsewhereIsFoundThere) {
  Subject subject = subject_of(*twin);
  const Eigen::RowVector3d shift(1.5, -2, 1);
  const calibration::Measurement moved = scan_elsewhere(*twin, shift);
  subject.scene.measurements = {&moved};
  ExamineOptions options;
  options.other_meshes = false;
  options.refits = 0;
  options.priors = twin_priors();
  options.priors.known.registration_mm = 2, options.priors.known.registration_rad = 0.026;
  const auto there = examine(subject, options);
  EXPECT_EQ(there->diagnosis.verdict, Verdict::nothing_missing) << there->diagnosis.why;
  ASSERT_EQ(there->places.size(), 1u);
  const ScanPlace& place = there->places[0];
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(place.shift_mm[i], shift[i], 3 * place.sd[i] + 0.02) << i;
  EXPECT_LT(place.sd.head<3>().maxCoeff(), 1.5) << "the scan says more than the prior";
}

TEST_F(NullTwin, EveryEffectThatCanBeFeltIsACandidate) {
  const auto has = [](const std::string& effect) {
    return std::any_of(found->table.scores.begin(), found->table.scores.end(),
                       [&effect](const Score& s) { return s.effect == effect; });
  };
  EXPECT_TRUE(has("misregistration"));  // moves no shape, only the scan: still a candidate
  EXPECT_TRUE(has("gravity_tilt"));
  EXPECT_TRUE(has("ligament"));
  // Without gland or tumour in the mesh there is nothing to make stiffer.
  EXPECT_NE(std::find(found->unseen.begin(), found->unseen.end(), "gland_stiffness"), found->unseen.end());
  EXPECT_FALSE(has("gland_stiffness"));
}

TEST_F(NullTwin, NothingStandsInForAnEffectWhoseLinesAgree) {
  for (const Candidate& candidate : found->candidates) EXPECT_FALSE(candidate.stand_in) << candidate.effect;
}

TEST_F(NullTwin, AFurtherPoseSeparatesMoreThanTheSameAgain) {
  const auto next = next_measurements(subject_of(*twin), *found, {"adhesion", "ligament"});
  ASSERT_GE(next.size(), 2u);
  double again = -1;
  for (const Separation& s : next) {
    EXPECT_GT(s.separation, 0);
    if (s.measurement.find("once more") != std::string::npos) again = s.separation;
  }
  EXPECT_GT(next.front().separation, again);
}

TEST_F(NullTwin, TheSameOnceMoreShowsNoLessThanOnce) {
  const std::vector<std::string> unseen = not_seen(*found);
  double power = 0, weights = 0;
  for (const Score& score : found->table.scores) {
    if (std::find(unseen.begin(), unseen.end(), score.effect) == unseen.end()) continue;
    const double weight = found->priors.of_effect(found->effects(), score.effect);
    power += weight * score.power;
    weights += weight;
  }
  ASSERT_GT(weights, 0);
  for (const Separation& s : next_measurements(subject_of(*twin), *found, {})) {
    if (s.measurement.find("once more") == std::string::npos) continue;
    EXPECT_GE(s.single_power, 0.95 * power / weights);
  }
}

TEST_F(NullTwin, TheLessIsKnownOfWhereAScanLiesTheLessAFurtherOneSeparates) {
  const auto separation = [](double registration_mm) {
    const simulation::MeasurementTolerances known = found->priors.known;
    found->priors.known.registration_mm = registration_mm, found->priors.known.registration_rad = registration_mm / 80;
    const auto next = next_measurements(subject_of(*twin), *found, {"adhesion", "gravity_tilt"});
    found->priors.known = known;
    double best = 0;
    for (const Separation& s : next) best = std::max(best, s.separation);
    return best;
  };
  EXPECT_LT(separation(2), 0.9 * separation(0.05));
}

TEST_F(NullTwin, TheNoisierAFurtherScanTheLessItSeparates) {
  const auto separation = [](double factor) {
    const Eigen::VectorXd noise = found->base.noise_of_point_mm;
    found->base.noise_of_point_mm *= factor;
    const auto next = next_measurements(subject_of(*twin), *found, {"adhesion", "gravity_tilt"});
    found->base.noise_of_point_mm = noise;
    double best = 0;
    for (const Separation& s : next)
      if (s.measurement.find("once more") == std::string::npos) best = std::max(best, s.separation);
    return best;
  };
  const double usual = separation(1);
  EXPECT_GT(usual, 0);
  EXPECT_LT(separation(5), 0.9 * usual);
}

TEST_F(NullTwin, TheHotSpotIsWhereTheDistanceIs) {
  constexpr double depth_mm = -2, radius_mm = 30;
  const calibration::ModelSkin skin(twin->mesh, found->base.fit.prediction.solution.poses[0].x);
  calibration::Residuals r = found->base.fit.residuals;
  Eigen::Index top;
  r.q.rowwise().squaredNorm().minCoeff(&top);  // the middle of the mound
  const Eigen::RowVector3d centre = r.place.row(top);
  for (Eigen::Index i = 0; i < r.size(); ++i)
    r.distance_mm[i] = (r.place.row(i) - centre).norm() < radius_mm ? depth_mm : 0.0;
  const auto spots = find_hot_spots(skin, skin_error(skin, r, found->base.fit.prediction, 0), {}, "supine");
  ASSERT_EQ(spots.size(), 1u);
  // The rim is smoothed over an edge of this coarse skin.
  EXPECT_LT(spots[0].mean_signed_mm, 0.5 * depth_mm);
  EXPECT_GE(spots[0].mean_signed_mm, depth_mm);
  EXPECT_GT(spots[0].area_cm2, 15);  // π 3² = 28 cm²
  EXPECT_LT(spots[0].area_cm2, 60);
  EXPECT_LT((spots[0].centre_mm.transpose() - centre).norm(), 0.5 * radius_mm);
}

TEST_F(NullTwin, NoHotSpotWithoutDistance) {
  const calibration::ModelSkin skin(twin->mesh, found->base.fit.prediction.solution.poses[0].x);
  calibration::Residuals r = found->base.fit.residuals;
  r.distance_mm.setZero();
  EXPECT_TRUE(find_hot_spots(skin, skin_error(skin, r, found->base.fit.prediction, 0), {}, "supine").empty());
}

TEST(TwinDiagnosis, ALigamentIsNamedByTwoScansTogetherAndEachPredictedFromTheOtherBearsItOut) {
  const simulation::Model truth = twin_with("ligament", "stiffness_kpa_per_mm", 2.0);
  const Twin twin({truth, twin_noise_mm}), again({truth, twin_noise_mm, 2});
  Subject subject = subject_of(twin);
  calibration::Measurement second = std::move(*again.measurement);
  second.pose.name = "again";
  subject.scene.measurements.push_back(&second);
  subject.noise_mm.push_back(twin_noise_mm);
  const auto found = findings_of(subject, 3);
  EXPECT_EQ(found->diagnosis.verdict, Verdict::missing) << found->diagnosis.why;
  EXPECT_TRUE(names(found->diagnosis, "ligament"));
  EXPECT_EQ(found->included.front().effect, "ligament");
  EXPECT_GT(found->included.front().left_out_gain, 0);
}

TEST(TwinDiagnosis, AHillOfTheChestWallIsFoundWhereItStands) {
  simulation::Model truth = twin_with("chest_wall_motion", "amplitude_mm", 6);
  truth.effects[0].parameters.at("centre_lateral").value = 0.35;
  const Twin twin({truth, twin_noise_mm});
  const auto found = findings_of(twin, 3);
  ASSERT_EQ(found->diagnosis.verdict, Verdict::missing) << found->diagnosis.why;
  ASSERT_TRUE(names(found->diagnosis, "chest_wall_motion")) << found->diagnosis.why;
  int seen = 0;
  for (const Refit& refit : found->refits)
    if (refit.effects == std::vector<std::string>{"chest_wall_motion"})
      for (const FittedParameter& p : refit.parameters) {
        if (p.name == "chest_wall_motion.centre_lateral") {
          EXPECT_GT(p.low, 0.05);
          EXPECT_LT(p.low, 0.35);
          EXPECT_GT(p.high, 0.35);
          ++seen;
        }
        if (p.name == "chest_wall_motion.amplitude_mm") {
          EXPECT_LT(p.low, 6);
          EXPECT_GT(p.high, 6);
          ++seen;
        }
      }
  EXPECT_EQ(seen, 2);
}

TEST(TwinDiagnosis, AnErrorOfMeasurementAtTheEndOfItsRangeIsNoFindingAndOneInsideIs) {
  const auto ends = [](const std::string& effect, const std::string& parameter, double value) {
    const auto found = findings_of(Twin({twin_with(effect, parameter, value), twin_noise_mm}), 3);
    std::string told = verdict_name(found->diagnosis.verdict) + ":";
    for (const std::string& name : found->diagnosis.missing) told += " " + name;
    for (const Refit& refit : found->refits)
      for (const FittedParameter& p : refit.parameters) told += "\n" + p.name + " " + std::to_string(p.value);
    const auto list = measurements_at_end(*found);
    found->unlisted.probability = 0.6;
    EXPECT_TRUE(measurements_at_end(*found).empty()) << "what something local explains as well is no wrong input";
    return std::pair(list, told);
  };
  const auto [tilted, told] = ends("gravity_tilt", "roll_rad", 0.7);
  ASSERT_EQ(tilted.size(), 1u) << told;
  EXPECT_EQ(tilted[0].name, "gravity_tilt.roll_rad");
  EXPECT_EQ(tilted[0].bound, 0.6);
  EXPECT_NEAR(tilted[0].value, 0.6, 0.06);
  EXPECT_TRUE(ends("gravity_tilt", "roll_rad", 0.3).first.empty());
  // The muscle is no measurement: how far it moved at least is a finding.
  EXPECT_TRUE(ends("chest_wall_motion", "amplitude_mm", 18).first.empty());
}

TEST(TwinDiagnosis, ALadderAddsTwoEffectsOneAfterTheOtherAndShowsWhatElseCouldHaveBeenAdded) {
  simulation::Model truth = twin_with("gravity_tilt", "roll_rad", 0.2);
  truth.effects.push_back(twin_with("chest_wall_motion", "amplitude_mm", 7).effects[0]);
  const Twin twin({truth, twin_noise_mm});
  const Subject subject = subject_of(twin);
  ExamineOptions options;
  options.other_meshes = false;
  options.refits = 5;
  options.priors = twin_priors();
  const auto both = examine(subject, options);
  ASSERT_EQ(both->beside.size(), 1u) << both->diagnosis.why;
  const Findings::Beside& beside = both->beside.front();
  EXPECT_EQ(beside.effects.size(), 1u);
  EXPECT_GT((beside.ground->errors - both->base.errors).norm(), 0);
  EXPECT_EQ(both->hypotheses.front().effects.size(), 2u);
  for (const Hypothesis& h : both->hypotheses)
    EXPECT_EQ(h.ground, is_part_of(beside.effects, h.effects) ? beside.ground.get() : &both->base);
  EXPECT_TRUE(names(both->diagnosis, "gravity_tilt") && names(both->diagnosis, "chest_wall_motion"));
  const Ladder ladder = climb(subject, options, *both);
  ASSERT_EQ(ladder.rungs.size(), 3u) << ladder.stopped;
  std::set<std::string> added;
  for (std::size_t r = 1; r < ladder.rungs.size(); ++r) {
    const Rung &rung = ladder.rungs[r], &before = ladder.rungs[r - 1];
    added.insert(rung.added);
    EXPECT_LT(rung.held_out_rms_mm, before.held_out_rms_mm);
    ASSERT_TRUE(rung.refit_only.has_value());
    EXPECT_EQ(rung.refit_only->rms_mm, before.rms_mm);
    ASSERT_TRUE(rung.random_other.has_value());
    EXPECT_FALSE(added.contains(rung.random_other->added)) << rung.random_other->added << " is in the model already";
    EXPECT_LT(rung.rms_mm, rung.random_other->rms_mm);
  }
  EXPECT_EQ(added, (std::set<std::string>{"gravity_tilt", "chest_wall_motion"}));
  EXPECT_EQ(ladder.last.verdict, Verdict::nothing_missing) << ladder.last.why;
  EXPECT_EQ(ladder.model.effects.size(), 2u);
}

TEST(TwinDiagnosis, TheMapOfMissingForcesShowsATractionAndStaysBelowItsThresholdWithoutOne) {
  const auto map_of = [](const Twin& twin, const Findings& found) {
    const FitErrors errors(found.base, found.base.nuisances, 0);
    return force_map(twin.scene(), found.base.model, found.base.fit, errors.metric(), 1, 40);
  };
  const Twin pulled({twin_with("arm_traction", "lateral_kpa", 0.3), twin_noise_mm});
  const auto found = findings_of(pulled, 0);
  const ForceMap map = map_of(pulled, *found);
  EXPECT_GT(map.evidence_gain, map.null_gain);
  Eigen::Index strongest;
  EXPECT_GT(map.force_kpa.rowwise().norm().maxCoeff(&strongest), map.threshold_kpa);
  EXPECT_GT(map.force_kpa.row(strongest).dot(pulled.anatomy.lateral), 0);
  const Twin quiet({supine::testing::twin_truth(), twin_noise_mm});
  const auto nothing = findings_of(quiet, 0);
  const ForceMap none = map_of(quiet, *nothing);
  EXPECT_LT(none.evidence_gain, 0.2 * map.evidence_gain);
}

}  // namespace
}  // namespace supine::diagnosis
