// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/other_poses.h"

#include <gtest/gtest.h>

#include "diagnosis/refit.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;
using supine::testing::twin_truth;

constexpr double noise_mm = 0.3;

simulation::Model with_gravity_tilt(double roll_rad) {
  simulation::Model model = twin_truth();
  simulation::EffectSetting setting = free_setting("gravity_tilt");
  setting.parameters.at("roll_rad").value = roll_rad;
  model.effects = {setting};
  return model;
}

/// Two scans of one body; the first is fitted, the second looked at.
class TwoScans {
 public:
  explicit TwoScans(const simulation::Model& truth)
      : first_({truth, noise_mm, 1}), second_({truth, noise_mm, 2}), whole_(first_.scene()) {
    whole_.measurements.push_back(second_.measurement.get());
    calibration::Evaluator evaluator(first_.scene(), twin_truth());
    const calibration::Prediction prediction = evaluator.predict(twin_truth());
    metric_.mask = calibration::points_over_skin(prediction);
    metric_.noise_mm = {noise_mm};
    const auto residuals = calibration::residuals_of(first_.scene(), prediction, metric_.mask, metric_.noise_mm);
    metric_.mean_mm = sources_.mean_mm = Eigen::VectorXd::Zero(residuals.size());
    sources_.noise_mm = residuals.sigma_mm;
    sources_.spread_mm = 0.01;
    whitening_ = Whitening::of(residuals, sources_);
    metric_.whitening = &whitening_;
  }

  /// The second scan at these numbers, as a refit of @p base where it is given.
  OtherPoses seen(const simulation::Model& model, const OtherPoses* base = nullptr) const {
    const calibration::FreeParameters parameters(model);
    calibration::Evaluator evaluator(first_.scene(), model);
    const WeightedFit fit = weigh(evaluator, parameters, metric_, parameters.start(), nullptr);
    if (base != nullptr) return other_poses_of_refit(whole_, parameters, fit, sources_, *base);
    return other_poses_of_base(whole_, parameters, fit, sources_, metric_, {0.05, 0.001, 0.05, 0.05, 0.01});
  }

 private:
  Twin first_, second_;
  calibration::Scene whole_;
  Whitening whitening_;
  Metric metric_;
  ErrorSources sources_;
};

TEST(OtherPoses, OfAModelThatLacksNothingErrorsAloneAreLeft) {
  const OtherPoses base = TwoScans(twin_truth()).seen(twin_truth());
  ASSERT_EQ(base.unfitted, 1u);
  EXPECT_NEAR(base.misfit, 1, 0.3);
  EXPECT_NEAR(base.rms_mm().at(0), noise_mm, 0.05);
}

TEST(OtherPoses, GainByWhatIsMissingAndLoseByWhatIsNot) {
  const TwoScans tilted(with_gravity_tilt(0.1)), plain(twin_truth());
  const OtherPoses base = tilted.seen(twin_truth()), with = tilted.seen(with_gravity_tilt(0.1), &base);
  EXPECT_GT(base.misfit, 1.5);
  EXPECT_NEAR(with.misfit, 1, 0.3);
  EXPECT_GT(base.objective - with.objective, 20);
  EXPECT_GT(with.change_mm(base).at(0), 0.2);
  const OtherPoses nothing = plain.seen(twin_truth());
  EXPECT_LT(nothing.objective - plain.seen(with_gravity_tilt(0.1), &nothing).objective, -20);
}

TEST(OtherPoses, SayNothingOnceTheFittedScanIsSaidToLieElsewhere) {
  simulation::Model model = twin_truth();
  model.effects = {free_setting("misregistration")};
  const OtherPoses base = TwoScans(twin_truth()).seen(model);
  EXPECT_EQ(base.unfitted, 0u);
  EXPECT_TRUE(base.distance_mm.empty());
}

}  // namespace
}  // namespace supine::diagnosis
