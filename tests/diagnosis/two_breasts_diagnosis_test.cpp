// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/examine.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;

constexpr double noise_mm = 0.3;

TEST(TwoBreastsDiagnosis, NamesUnequalModuli) {
  simulation::Model base = supine::testing::soft_model();
  base.breast.young_modulus_kpa = {0.9, true, {}, 0.1, 10};
  Twin::Options made{base, noise_mm};
  simulation::EffectSetting effect = simulation::null_setting(*simulation::find_effect("left_right_stiffness"));
  effect.parameters.at("log_ratio").value = 0.5;
  made.truth.effects = {effect};
  made.body = &supine::testing::two_breasts_scene();
  const Twin twin(made);
  ExamineOptions options;
  options.other_meshes = false;  // scan and model share theirs
  options.refits = 3;
  options.priors.known.registration_mm = 0.05, options.priors.known.registration_rad = 0.001;
  options.priors.patchiness = {.tissue = 0.05, .skin = 0.05, .muscle_mm = 0.05};  // both are even
  const auto found = examine({twin.scene(), base, base, {noise_mm}, nullptr}, options);
  const auto& missing = found->diagnosis.missing;
  EXPECT_NE(std::find(missing.begin(), missing.end(), "left_right_stiffness"), missing.end())
      << fmt::format("{}", fmt::join(missing, ", "));
  EXPECT_NE(found->diagnosis.verdict, Verdict::nothing_missing);
}

}  // namespace
}  // namespace supine::diagnosis
