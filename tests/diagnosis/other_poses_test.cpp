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

/// Scans of one body; the first is fitted, the others are looked at.
class Scans {
 public:
  explicit Scans(const simulation::Model& truth, int others = 1)
      : first_({truth, noise_mm, 1}), whole_(first_.scene()) {
    for (int i = 0; i < others; ++i) {
      looked_at_.push_back(std::make_unique<Twin>(Twin::Options{truth, noise_mm, static_cast<unsigned>(2 + i)}));
      whole_.measurements.push_back(looked_at_.back()->measurement.get());
    }
    calibration::Evaluator evaluator(first_.scene(), twin_truth());
    const calibration::Prediction prediction = evaluator.predict(twin_truth());
    metric_.mask = calibration::points_over_skin(prediction);
    metric_.noise_mm = {noise_mm};
    residuals_ = calibration::residuals_of(first_.scene(), prediction, metric_.mask, metric_.noise_mm);
    metric_.mean_mm = sources.mean_mm = Eigen::VectorXd::Zero(residuals_.size());
    sources.noise_mm = residuals_.sigma_mm;
    sources.spread_mm = 0.01;
  }

  /// The others at these numbers, as a refit of @p base where it is given.
  OtherPoses seen(const simulation::Model& model, const OtherPoses* base = nullptr) {
    const Whitening whitening = Whitening::of(residuals_, sources);
    metric_.whitening = &whitening;
    const calibration::FreeParameters parameters(model);
    calibration::Evaluator evaluator(first_.scene(), model);
    const WeightedFit fit = weigh(evaluator, parameters, metric_, parameters.start(), nullptr);
    if (base != nullptr) return other_poses_of_refit(whole_, parameters, fit, sources, *base);
    return other_poses_of_base(whole_, parameters, fit, sources, metric_, {0.05, 0.001, 0.05, 0.05, 0.01});
  }

  calibration::Measurement& other(std::size_t i) { return *looked_at_[i]->measurement; }

  ErrorSources sources;  ///< of the fitted scan

 private:
  Twin first_;
  std::vector<std::unique_ptr<Twin>> looked_at_;
  calibration::MeasuredScene whole_;
  calibration::Residuals residuals_;
  Metric metric_;
};

TEST(OtherPoses, OfAModelThatLacksNothingErrorsAloneAreLeft) {
  const OtherPoses base = Scans(twin_truth()).seen(twin_truth());
  ASSERT_EQ(base.unfitted, 1u);
  EXPECT_NEAR(base.misfit, 1, 0.3);
  EXPECT_NEAR(base.rms_mm().at(0), noise_mm, 0.05);
  ASSERT_EQ(base.noise_mm.size(), 1u);
  EXPECT_NEAR(base.noise_mm[0], noise_mm, 0.05);
}

TEST(OtherPoses, GainByWhatIsMissingAndLoseByWhatIsNot) {
  Scans tilted(with_gravity_tilt(0.1)), plain(twin_truth());
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
  const OtherPoses base = Scans(twin_truth()).seen(model);
  EXPECT_EQ(base.unfitted, 0u);
  EXPECT_TRUE(base.distance_mm.empty());
}

TEST(OtherPoses, AreSeenEach) {
  Scans scans(with_gravity_tilt(0.1), 2);
  const OtherPoses base = scans.seen(twin_truth()), with = scans.seen(with_gravity_tilt(0.1), &base);
  ASSERT_EQ(base.unfitted, 2u);
  const std::vector<double> before = base.rms_mm(), after = with.rms_mm();
  ASSERT_EQ(after.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LT(after[i], 0.9 * before[i]);
  const OtherPoses one = Scans(with_gravity_tilt(0.1)).seen(twin_truth());
  EXPECT_NEAR(one.rms_mm()[0], before[0], 1e-6);
  EXPECT_GT(base.objective, 1.5 * one.objective);
}

TEST(OtherPoses, JudgeNothingWhereOneHasNoPointOverTheSkin) {
  Scans scans(twin_truth(), 2);
  scans.other(1).pose.name = "tilted";
  for (int i = 0; i < scans.other(1).scan.points().rows(); ++i) scans.other(1).left_out.push_back(i);
  const OtherPoses base = scans.seen(twin_truth());
  EXPECT_EQ(base.unfitted, 0u);
  EXPECT_TRUE(base.distance_mm.empty());
  EXPECT_NE(base.failure.find("tilted"), std::string::npos) << base.failure;
}

TEST(OtherPoses, AreCorrectedForTheMeshAndItsDoubtfulShareForgiven) {
  Scans scans(twin_truth());
  const OtherPoses plain = scans.seen(twin_truth());
  EXPECT_TRUE(plain.failure.empty());
  const Eigen::VectorXd change = Eigen::VectorXd::Constant(scans.other(0).scan.points().rows(), 0.6);
  scans.sources.unfitted_mean_mm = {change};
  scans.sources.mean_doubt = 0;
  const OtherPoses sure = scans.seen(twin_truth());
  EXPECT_NEAR((sure.distance_mm[0] - plain.distance_mm[0]).mean(), 0.6, 1e-6);
  EXPECT_GT(sure.misfit, 1.5 * plain.misfit) << "a wrong correction shows";
  scans.sources.mean_doubt = 1;
  EXPECT_NEAR(scans.seen(twin_truth()).misfit, plain.misfit, 0.1);
}

TEST(OtherPoses, ForgiveWhatTheFittedScanLeavesUncertain) {
  Scans scans(twin_truth());
  simulation::Model softer = twin_truth();
  softer.breast.young_modulus_kpa.value *= 0.8;
  const OtherPoses sure = scans.seen(softer);
  EXPECT_GT(sure.misfit, 1.5);
  scans.sources.noise_mm *= 30;  // of the fitted scan alone: its fit is 30 times as uncertain
  EXPECT_LT(scans.seen(softer).misfit, 1.3);
}

}  // namespace
}  // namespace supine::diagnosis
