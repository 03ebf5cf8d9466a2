// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/free_parameters.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"
#include "simulation/parameters.h"

namespace supine::calibration {
namespace {

simulation::Model model_with_ligament() {
  simulation::Model model;
  model.breast.young_modulus_kpa = {0.5, true, 0.4, 0.05, 5};
  model.effects.push_back({"ligament", {{"stiffness_kpa_per_mm", {0.4, true, 0.2, 0, 4}}}, {}});
  model.effects.push_back({"gravity_tilt", {{"roll_rad", {-0.1, true, {}, -0.6, 0.6}}, {"pitch_rad", {0.2}}}, {}});
  return model;
}

TEST(FreeParameters, AreThoseWrittenAsTables) {
  const FreeParameters parameters(model_with_ligament());
  EXPECT_EQ(parameters.names(), (std::vector<std::string>{"breast.young_modulus_kpa", "ligament.stiffness_kpa_per_mm",
                                                          "gravity_tilt.roll_rad"}));
  EXPECT_TRUE(parameters.is_log(0));   // positive
  EXPECT_FALSE(parameters.is_log(1));  // may be zero
  EXPECT_FALSE(parameters.is_log(2));  // has either sign
}

TEST(FreeParameters, CoordinatesAndValuesAreInverse) {
  const FreeParameters parameters(model_with_ligament());
  const Eigen::VectorXd values = parameters.values(parameters.start());
  EXPECT_NEAR(values[0], 0.5, 1e-15);
  EXPECT_NEAR(values[1], 0.4, 1e-15);
  EXPECT_NEAR(values[2], -0.1, 1e-15);
  const double h = 1e-6;
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(parameters.coordinate(i, parameters.value(i, 0.3)), 0.3, 1e-14);
    const double slope = (parameters.value(i, 0.3 + h) - parameters.value(i, 0.3 - h)) / (2 * h);
    EXPECT_NEAR(parameters.slope(Eigen::VectorXd::Constant(3, 0.3))[i], slope, 1e-7 * std::abs(slope));
  }
}

TEST(FreeParameters, StepsAreAsLongAsThePriorOrTheCatalogueSay) {
  const FreeParameters parameters(model_with_ligament());
  EXPECT_NEAR(parameters.value(1, 1) - parameters.value(1, 0), 0.2, 1e-15);  // its prior_sd
  const double spread = simulation::find_parameter("gravity_tilt.roll_rad")->spread;
  ASSERT_GT(spread, 0);
  EXPECT_NEAR(parameters.value(2, 1) - parameters.value(2, 0), spread, 1e-15);  // no prior_sd is written
}

TEST(FreeParameters, ModelCarriesTheNumbersAndNothingElseChanges) {
  const FreeParameters parameters(model_with_ligament());
  Eigen::VectorXd u = parameters.start();
  u[0] = std::log(0.8);
  u[2] = parameters.coordinate(2, 0.05);
  const simulation::Model model = parameters.model(u);
  EXPECT_NEAR(model.breast.young_modulus_kpa.value, 0.8, 1e-15);
  EXPECT_NEAR(model.effects[1].parameters.at("roll_rad").value, 0.05, 1e-15);
  EXPECT_EQ(model.effects[1].parameters.at("pitch_rad").value, 0.2);
  EXPECT_EQ(model.skin.young_modulus_kpa.value, 20);
}

TEST(FreeParameters, ASearchMayBeginElsewhereThanInTheMiddleOfThePrior) {
  FreeParameters parameters(model_with_ligament());
  simulation::Model stiffer = model_with_ligament();
  stiffer.breast.young_modulus_kpa.value = 1.5;
  parameters.begin_with(stiffer);
  EXPECT_NEAR(parameters.value(0, parameters.start()[0]), 1.5, 1e-14);
  EXPECT_NEAR(parameters.priors()[0]->mean, std::log(0.5), 1e-15);
  EXPECT_NEAR(parameters.value(1, parameters.start()[1]), 0.4, 1e-15);
  stiffer.breast.young_modulus_kpa.value = 6;
  EXPECT_THROW(parameters.begin_with(stiffer), InputError);
}

TEST(FreeParameters, PriorOfAPositiveParameterIsLogNormal) {
  const FreeParameters parameters(model_with_ligament());
  ASSERT_TRUE(parameters.priors()[0]);
  EXPECT_NEAR(parameters.priors()[0]->mean, std::log(0.5), 1e-15);
  EXPECT_NEAR(parameters.priors()[0]->sd, std::log(1 + 0.4 / 0.5), 1e-15);
  EXPECT_NEAR(parameters.priors()[1]->sd, 1, 1e-15);  // scaled by prior_sd
  EXPECT_FALSE(parameters.priors()[2]);
  Eigen::VectorXd u = parameters.start();
  u[0] += 2 * parameters.priors()[0]->sd;
  u[2] += 0.1;
  EXPECT_NEAR(parameters.prior_deviation(u)[0], 2, 1e-12);
  EXPECT_EQ(parameters.prior_deviation(u)[2], 0);
  EXPECT_NEAR(parameters.prior_information()[0], std::pow(parameters.priors()[0]->sd, -2), 1e-12);
  EXPECT_EQ(parameters.prior_information()[2], 0);
}

TEST(FreeParameters, KnowsItsBounds) {
  const FreeParameters parameters(model_with_ligament());
  Eigen::VectorXd u = Eigen::VectorXd::Constant(3, 100);
  u = parameters.clamped(u);
  EXPECT_NEAR(parameters.values(u)[0], 5, 1e-12);
  EXPECT_TRUE(parameters.at_bound(u, 0));
  EXPECT_FALSE(parameters.at_bound(parameters.start(), 0));
}

TEST(FreeParameters, RefusesWhatCannotBeVaried) {
  EXPECT_THROW(FreeParameters(simulation::Model{}), InputError);  // nothing is free
  EXPECT_THROW(FreeParameters(model_with_ligament(), {"breast.colour"}), InputError);
  EXPECT_THROW(FreeParameters(model_with_ligament(), {"adhesion.log_factor"}), InputError);  // not in the model
  simulation::Model outside = model_with_ligament();
  outside.breast.young_modulus_kpa.value = 6;
  EXPECT_THROW(FreeParameters{outside}, InputError);
}

}  // namespace
}  // namespace supine::calibration
