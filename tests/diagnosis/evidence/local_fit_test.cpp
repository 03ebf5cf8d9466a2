// SPDX-License-Identifier: AGPL-3.0-or-later
// A local cause that no effect lists, followed through the chain: found where it is, not found where none is.
#include "diagnosis/evidence/local_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/evidence/hypotheses.h"
#include "diagnosis/weighted_fit.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;

constexpr double log_ratio = 2, lateral = 0.35, head = 0.1, height = 0.5;
constexpr double low_mm = -6, low_lateral = 0.55;

simulation::Model with_spot(const char* of) {
  simulation::Model model = supine::testing::twin_truth();
  simulation::EffectSetting spot = simulation::null_setting(*simulation::find_effect("local_stiffness"));
  spot.parameters.at("log_ratio").value = log_ratio;
  spot.parameters.at("centre_lateral").value = lateral;
  spot.parameters.at("centre_head").value = head;
  spot.parameters.at("height").value = height;
  spot.options.at("of") = of;
  model.effects.push_back(spot);
  return model;
}

/// A support that has given way where the hill of chest_wall_motion cannot stand.
simulation::Model with_low_muscle() {
  simulation::Model model = supine::testing::twin_truth();
  simulation::EffectSetting hill = simulation::null_setting(*simulation::find_effect("local_muscle"));
  hill.parameters.at("offset_mm").value = low_mm;
  hill.parameters.at("centre_lateral").value = low_lateral;
  hill.parameters.at("length").value = 0.3;
  model.effects.push_back(hill);
  return model;
}

/// A base fit of a twin, and the hypothesis that nothing is missing.
struct Fitted {
  explicit Fitted(const simulation::Model& truth)
      : twin({truth, 0.1}), given(supine::testing::twin_start()), evaluator(twin.scene(), given, accurate_enough()) {
    BaseFitOptions options;
    options.other_meshes = false;
    base.emplace(fit_base_model(evaluator, given, given, {0.1}, nullptr, options));
    hypotheses = Screening(*base, {}, priors).hypotheses();
  }
  Twin twin;
  simulation::Model given;
  calibration::Evaluator evaluator;
  Priors priors;
  std::optional<BaseFit> base;
  std::vector<Hypothesis> hypotheses;
};

TEST(LocalFit, FindsAStiffSpotOfTissueWhereItIs) {
  Fitted fitted(with_spot("tissue"));
  const double along_lines = weigh_unlisted(*fitted.base, fitted.priors, fitted.hypotheses).probability;
  const auto followed =
      follow_local_causes(fitted.twin.scene(), fitted.given, *fitted.base, fitted.priors, fitted.hypotheses);
  const auto tissue = std::find_if(followed.begin(), followed.end(),
                                   [](const FollowedCause& one) { return one.kind == LocalKind::tissue; });
  ASSERT_NE(tissue, followed.end());
  EXPECT_LT(tissue->low, log_ratio);
  EXPECT_GT(tissue->high, log_ratio);
  EXPECT_GT(tissue->low, 0);
  const meshing::Anatomy& anatomy = fitted.twin.anatomy;
  const Eigen::Vector3d truth =
      anatomy.foot_centre_mm +
      anatomy.foot_radius_mm * (lateral * anatomy.lateral + head * anatomy.head + height * anatomy.outward);
  EXPECT_LT((tissue->place_mm - truth).norm(), 3 * tissue->within_mm);
  const Unlisted found = weigh_unlisted(*fitted.base, fitted.priors, fitted.hypotheses, followed);
  EXPECT_GT(found.probability, std::max(0.5, along_lines));
  EXPECT_EQ(found.kind, LocalKind::tissue);
  EXPECT_EQ(found.place_mm, tissue->place_mm);
}

TEST(LocalFit, FindsAMuscleThatHasGivenWayWhereItIs) {
  Fitted fitted(with_low_muscle());
  weigh_unlisted(*fitted.base, fitted.priors, fitted.hypotheses);
  const auto followed =
      follow_local_causes(fitted.twin.scene(), fitted.given, *fitted.base, fitted.priors, fitted.hypotheses);
  const auto muscle = std::find_if(followed.begin(), followed.end(),
                                   [](const FollowedCause& one) { return one.kind == LocalKind::muscle; });
  ASSERT_NE(muscle, followed.end());
  EXPECT_LT(muscle->low, low_mm);
  EXPECT_GT(muscle->high, low_mm);
  EXPECT_LT(muscle->high, 0);
  const meshing::Anatomy& anatomy = fitted.twin.anatomy;
  const Eigen::Vector3d truth = anatomy.foot_centre_mm + anatomy.foot_radius_mm * low_lateral * anatomy.lateral;
  EXPECT_LT((muscle->place_mm - truth).norm(), 3 * muscle->within_mm);
  EXPECT_EQ(muscle->effect.name, "local_muscle");
  EXPECT_EQ(muscle->effect.parameters.at("offset_mm").value, muscle->size);
  const Unlisted found = weigh_unlisted(*fitted.base, fitted.priors, fitted.hypotheses, followed);
  EXPECT_GT(found.probability, 0.5);
  EXPECT_EQ(found.kind, LocalKind::muscle);
  EXPECT_TRUE(found.effect.has_value());
}

TEST(LocalFit, IsAskedHoweverUnlikelyNothingIsWhereItIsLikelyBesideEffects) {
  Fitted fitted(with_low_muscle());
  weigh_unlisted(*fitted.base, fitted.priors, fitted.hypotheses);
  Hypothesis effects = fitted.hypotheses.front();
  effects.effects = {0};
  effects.ln_evidence += 100;
  effects.with_unlisted = {};
  fitted.hypotheses.insert(fitted.hypotheses.begin(), effects);
  normalise(fitted.hypotheses);
  const auto followed = [&fitted] {
    return follow_local_causes(fitted.twin.scene(), fitted.given, *fitted.base, fitted.priors, fitted.hypotheses);
  };
  EXPECT_TRUE(followed().empty()) << "effects alone explain all";
  fitted.hypotheses.front().with_unlisted[static_cast<std::size_t>(LocalKind::muscle)] = 0.9;
  const auto causes = followed();
  ASSERT_EQ(causes.size(), 1u);
  EXPECT_EQ(causes[0].kind, LocalKind::muscle);
  EXPECT_LT(causes[0].high, 0);
}

TEST(LocalFit, AHillThatTheCatalogueListsIsNoUnlistedMuscle) {
  simulation::Model truth = supine::testing::twin_truth();
  simulation::EffectSetting hill = simulation::null_setting(*simulation::find_effect("chest_wall_motion"));
  hill.parameters.at("amplitude_mm").value = 1.5 * low_mm;
  hill.parameters.at("centre_lateral").value = 0.3;
  truth.effects.push_back(hill);
  Fitted fitted(truth);
  EXPECT_GT(weigh_unlisted(*fitted.base, fitted.priors, fitted.hypotheses).probability, 0.2) << "it is asked for";
  for (const FollowedCause& one :
       follow_local_causes(fitted.twin.scene(), fitted.given, *fitted.base, fitted.priors, fitted.hypotheses))
    EXPECT_NE(one.kind, LocalKind::muscle);
}

TEST(LocalFit, IsNotAskedWhereNothingMayBeTold) {
  Fitted fitted(supine::testing::twin_truth());
  EXPECT_LT(weigh_unlisted(*fitted.base, fitted.priors, fitted.hypotheses).probability, 0.2);
  EXPECT_TRUE(
      follow_local_causes(fitted.twin.scene(), fitted.given, *fitted.base, fitted.priors, fitted.hypotheses).empty());
}

TEST(LocalFit, StartsWithThePlacesOfItsKind) {
  const Fitted fitted(supine::testing::twin_truth());
  for (const LocalKind kind : {LocalKind::tissue, LocalKind::skin, LocalKind::muscle}) {
    EXPECT_TRUE(can_follow(kind, fitted.twin.scene(), fitted.given));
    const simulation::EffectSetting setting = free_local_cause(fitted.twin.scene(), fitted.base->local, kind, 20);
    if (kind != LocalKind::muscle) {
      EXPECT_EQ(setting.options.at("of"), local_kind_name(kind));
    }
    for (const auto& [name, number] : setting.parameters) EXPECT_TRUE(number.free) << name;
    EXPECT_NEAR(setting.parameters.at("length").value, 20 / fitted.twin.anatomy.foot_radius_mm, 1e-12);
    EXPECT_LT(std::abs(setting.parameters.at("centre_lateral").value), 0.3);
  }
  EXPECT_FALSE(can_follow(LocalKind::muscle, fitted.twin.scene(), with_low_muscle()));
  EXPECT_TRUE(can_follow(LocalKind::muscle, fitted.twin.scene(), with_spot("skin")));
  EXPECT_FALSE(can_follow(LocalKind::tissue, fitted.twin.scene(), with_spot("skin")));
}

}  // namespace
}  // namespace supine::diagnosis
