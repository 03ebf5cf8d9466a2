// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/intervals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using supine::testing::Twin;
using supine::testing::twin_truth;

TEST(Intervals, OfAShapeThatTheScanSaysNothingOfIsItsPriorAsGiven) {
  const Twin twin({twin_truth(), 0.3});
  Refit refit;
  refit.effect = "ligament";
  refit.given = twin_truth();
  refit.given.effects = {free_setting("ligament")};
  const calibration::FreeParameters parameters(refit.given);
  const auto& names = parameters.names();
  const auto width = std::find(names.begin(), names.end(), "ligament.width_mm") - names.begin();
  ASSERT_LT(width, parameters.size());
  const double usual = parameters.value(width, parameters.start()[width]);

  calibration::Evaluator evaluator(twin.scene(), refit.given);
  const calibration::Prediction prediction = evaluator.predict(refit.given);
  Metric metric;
  metric.mask = calibration::points_over_skin(prediction);
  metric.noise_mm = {0.3};
  const auto residuals = calibration::residuals_of(twin.scene(), prediction, metric.mask, metric.noise_mm);
  ErrorSources sources;
  sources.mean_mm = metric.mean_mm = Eigen::VectorXd::Zero(residuals.size());
  sources.noise_mm = Eigen::VectorXd::Constant(residuals.size(), 1000);
  sources.spread_mm = 0.01;
  const Whitening whitening = Whitening::of(residuals, sources);
  metric.whitening = &whitening;
  Eigen::VectorXd u = parameters.start();
  u[width] = parameters.coordinate(width, 1.5 * usual);
  refit.fit = weigh(evaluator, parameters, metric, u, &prediction.solution);
  refit.model = parameters.model(u);

  settle(twin.scene(), sources, nullptr, Tolerances{}, metric, refit);
  const auto row = std::find_if(refit.parameters.begin(), refit.parameters.end(),
                                [](const FittedParameter& p) { return p.name == "ligament.width_mm"; });
  ASSERT_NE(row, refit.parameters.end());
  EXPECT_NEAR(row->value, usual, 0.01 * usual);
  const double sd = parameters.priors()[static_cast<std::size_t>(width)]->sd;
  const double high = usual * std::exp(1.96 * sd), low = usual * std::exp(-1.96 * sd);
  EXPECT_NEAR(row->high, high, 0.05 * high) << "widened a little: the catalogue's form is not the body's";
  EXPECT_NEAR(row->low, low, 0.05 * low);
}

}  // namespace
}  // namespace supine::diagnosis
