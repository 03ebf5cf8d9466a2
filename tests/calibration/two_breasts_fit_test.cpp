// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "calibration/least_squares.h"
#include "calibration/model_skin.h"
#include "simulation/parameters.h"
#include "tests/calibration/twin.h"

// Two breasts in one model: the scan tells their moduli apart.
namespace supine::calibration {
namespace {

using supine::testing::Twin;
using supine::testing::two_breasts_scene;

simulation::Model unequal(double log_ratio) {
  simulation::Model model = supine::testing::soft_model();
  model.breast.young_modulus_kpa = {0.9, true, {}, 0.1, 10};
  simulation::EffectSetting effect = simulation::null_setting(*simulation::find_effect("left_right_stiffness"));
  effect.parameters.at("log_ratio") = {log_ratio, true, 0.5, -2, 2};
  model.effects = {effect};
  return model;
}

Twin twin_of(double log_ratio, double noise_mm) {
  Twin::Options options{unequal(log_ratio), noise_mm};
  options.body = &two_breasts_scene();
  return Twin(options);
}

Eigen::VectorXd fitted(const Twin& twin) {
  const simulation::Model start = unequal(0);
  const FreeParameters parameters(start);
  EXPECT_EQ(parameters.size(), 2);
  Evaluator evaluator(twin.scene(), start);
  FitOptions options;
  options.noise_mm = {0.7};
  const Fit fit = fit_least_squares(evaluator, parameters, options);
  EXPECT_TRUE(fit.converged) << fit.message;
  return parameters.values(fit.u);
}

TEST(TwoBreastsFit, FindsTheRatioOfTheModuli) {
  const Eigen::VectorXd values = fitted(twin_of(std::log(1.5), 0));
  EXPECT_NEAR(values[0], 0.9, 0.01);
  EXPECT_NEAR(values[1], std::log(1.5), 0.01);
}

TEST(TwoBreastsFit, FindsItThroughNoiseAndTheOtherWayRound) {
  const Eigen::VectorXd values = fitted(twin_of(-0.3, 0.5));
  EXPECT_NEAR(values[0], 0.9, 0.05);
  EXPECT_NEAR(values[1], -0.3, 0.06);
}

TEST(TwoBreastsFit, AreasAreCountedPerSide) {
  const auto& scene = two_breasts_scene();
  const SkinAreas areas = anatomical_areas(scene.mesh, scene.anatomy);
  EXPECT_EQ(areas.names.size(), 18u);
  EXPECT_EQ(areas.names.front(), "left nipple area");
  for (Eigen::Index p = 0; p < scene.mesh.points.rows(); ++p)
    if (areas.of_point[p] >= 0) {
      ASSERT_EQ(areas.of_point[p] < 9, scene.mesh.points(p, 0) >= scene.anatomy.sternum_x_mm) << p;
    }
}

}  // namespace
}  // namespace supine::calibration
