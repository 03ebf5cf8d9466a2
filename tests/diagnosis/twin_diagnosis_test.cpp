// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>

#include "calibration/uncertainty.h"
#include "diagnosis/diagnose.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;

/// Calibrates the base model to the scan of @p truth and asks what it lacks.
FirstDiagnosis diagnosis_of(const simulation::Model& truth, double noise_mm) {
  const Twin twin({truth, noise_mm});
  const simulation::Model base = supine::testing::twin_truth();
  const calibration::FreeParameters parameters(base);
  calibration::Evaluator evaluator(twin.scene(), base);
  calibration::FitOptions options;
  options.noise_mm = {noise_mm};
  const calibration::Fit fit = calibration::fit_least_squares(evaluator, parameters, options);
  std::vector<std::string> unseen;
  const auto candidates = find_candidates(evaluator, parameters.model(fit.u), fit, unseen);
  // Scan and model share their mesh here, so white noise is the truth.
  const auto table =
      score_candidates(fit.residuals, fit.linearisation.slope, candidates, Whitening::independent(fit.residuals), 1);
  return decide(table, table, unseen, noise_mm);
}

simulation::Model with(const std::string& effect, const std::string& parameter, double value) {
  simulation::Model model = supine::testing::twin_truth();
  simulation::EffectSetting setting = simulation::null_setting(*simulation::find_effect(effect));
  for (const auto& row : simulation::find_effect(effect)->parameters()) setting.parameters[row.name].value = row.median;
  setting.parameters.at(parameter).value = value;
  model.effects = {setting};
  return model;
}

bool names(const FirstDiagnosis& result, const std::string& effect) {
  return std::find(result.missing.begin(), result.missing.end(), effect) != result.missing.end();
}

TEST(TwinDiagnosis, NothingIsMissingWhereNothingIs) {
  EXPECT_EQ(diagnosis_of(supine::testing::twin_truth(), 0.3).verdict, Verdict::nothing_missing);
}

TEST(TwinDiagnosis, DISABLED_ALigamentIsAmongWhatIsNamed) {
  const FirstDiagnosis result = diagnosis_of(with("ligament", "stiffness_kpa_per_mm", 0.05), 0.3);
  EXPECT_TRUE(result.verdict == Verdict::missing || result.verdict == Verdict::ambiguous);
  EXPECT_TRUE(names(result, "ligament"));
}

TEST(TwinDiagnosis, EveryEffectThatCanBeFeltIsACandidate) {
  const FirstDiagnosis result = diagnosis_of(supine::testing::twin_truth(), 0.3);
  const auto has = [&result](const std::string& effect) {
    return std::any_of(result.table.scores.begin(), result.table.scores.end(),
                       [&effect](const Score& s) { return s.effect == effect; });
  };
  EXPECT_TRUE(has("misregistration"));  // moves no shape, only the scan: still a candidate
  EXPECT_TRUE(has("gravity_tilt"));
  EXPECT_TRUE(has("ligament"));
  // Without gland or tumour in the mesh there is nothing to make stiffer.
  EXPECT_NE(std::find(result.unseen.begin(), result.unseen.end(), "gland_stiffness"), result.unseen.end());
  EXPECT_FALSE(has("gland_stiffness"));
}

}  // namespace
}  // namespace supine::diagnosis
