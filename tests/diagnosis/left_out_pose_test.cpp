// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/left_out_pose.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/diagnosis/sheet.h"

namespace supine::diagnosis {
namespace {

/// One modulus, and two poses whose distances it explains wholly, at different values.
struct TwoPoses {
  explicit TwoPoses(double wanted_by_first, double wanted_by_second) {
    model.breast.young_modulus_kpa = {1.0, true, {}, 0.1, 10};
    calibration::Residuals& r = fit.solution.residuals = supine::testing::sheet(5);
    r.pose.tail(r.size() - half).setOnes();
    fit.solution.linearisation.slope = Eigen::MatrixXd::Constant(r.size(), 1, 2.0);
    r.distance_mm.head(half).setConstant(-2 * wanted_by_first);
    r.distance_mm.tail(r.size() - half).setConstant(-2 * wanted_by_second);
    fit.solution.u = calibration::FreeParameters(model).start();
    sources.noise_mm = r.sigma_mm;
    sources.mean_mm = Eigen::VectorXd::Zero(r.size());
  }
  std::vector<double> rms() const {
    std::vector<double> each;
    for (const Eigen::VectorXd& d : left_out_poses_mm(fit, calibration::FreeParameters(model), sources))
      each.push_back(d.norm() / std::sqrt(static_cast<double>(d.size())));
    return each;
  }

  static constexpr Eigen::Index half = 300;
  simulation::Model model;
  WeightedFit fit;
  ErrorSources sources;
};

TEST(LeftOutPose, IsPredictedByWhatTheOthersWant) {
  const auto rms = TwoPoses(0.1, -0.3).rms();
  ASSERT_EQ(rms.size(), 2u);
  for (const double mm : rms) EXPECT_NEAR(mm, 2 * 0.4, 1e-6);
  const auto alike = TwoPoses(0.2, 0.2).rms();
  for (const double mm : alike) EXPECT_NEAR(mm, 0, 1e-6);
}

TEST(LeftOutPose, StaysInTheRange) {
  const auto rms = TwoPoses(0, 9).rms();  // the modulus may grow by a factor of ten
  EXPECT_NEAR(rms[0], 2 * std::log(10.0), 1e-6);
  EXPECT_NEAR(rms[1], 2 * 9, 1e-6);
}

TEST(LeftOutPose, AnErrorOfOneScanAloneIsNoReasonToStep) {
  TwoPoses poses(0, 0.5);
  // The second scan lies off as a whole, by a sigma of what is tolerated in that scan.
  Eigen::VectorXd shape = Eigen::VectorXd::Zero(poses.fit.solution.residuals.size());
  shape.tail(shape.size() - TwoPoses::half).setConstant(1.0);
  poses.sources.modes = {{"registration", shape}};
  const calibration::Residuals& r = poses.fit.solution.residuals;
  poses.model.breast.young_modulus_kpa.prior_sd = 0.05;
  EXPECT_LT(poses.rms()[0], 0.05) << "all of " << r.distance_mm.tail(1)[0] << " mm is left to the scan";
}

TEST(LeftOutPose, OnePoseAloneSaysNothing) {
  TwoPoses poses(0.1, 0.1);
  poses.fit.solution.residuals.pose.setZero();
  EXPECT_TRUE(poses.rms().empty());
}

}  // namespace
}  // namespace supine::diagnosis
