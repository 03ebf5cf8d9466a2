// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/never_known.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "calibration/uncertainty.h"
#include "diagnosis/evidence/nuisances.h"
#include "tests/calibration/twin.h"

namespace supine::diagnosis {
namespace {

using calibration::FreeParameters;
using supine::testing::Twin;
using supine::testing::twin_truth;

struct Fitted {
  Fitted() : twin({twin_truth(), 0.3}), evaluator(twin.scene(), twin_truth()), fit(fitted(twin_truth())) {}

  calibration::Fit fitted(const simulation::Model& model) {
    calibration::FitOptions options;
    options.noise_mm = {0.3};
    return calibration::fit_least_squares(evaluator, FreeParameters(model), options);
  }
  simulation::Model model() const { return FreeParameters(twin_truth()).model(fit.u); }

  Twin twin;
  calibration::Evaluator evaluator;
  calibration::Fit fit;
};

TEST(NeverKnown, TakesTheAnswerWhereAFitThatHasItGoes) {
  Fitted f;
  const Priors priors;
  const NeverKnown all = never_known_at(f.evaluator, f.model(), f.fit, priors);
  const calibration::Uncertainty worth = calibration::judge(f.fit, FreeParameters(twin_truth()), false, all.shapes_mm);
  const auto poses = poses_of(f.twin.scene());
  const std::vector<Nuisance> nuisances = nuisances_of(twin_truth(), poses, priors);
  ASSERT_EQ(nuisances.size(), all.sources.size());
  constexpr double share = 0.05;  // of a sigma
  for (std::size_t k = 0; k < nuisances.size(); ++k) {
    std::vector<Nuisance> one{nuisances[k]};
    one[0].value = share;
    const calibration::Fit moved = f.fitted(with_nuisances(twin_truth(), one, poses));
    const Eigen::VectorXd expected = share * worth.never_known.col(static_cast<Eigen::Index>(k));
    const Eigen::VectorXd slack = 0.1 * worth.white.diagonal().cwiseSqrt();  // what a settled descent leaves
    for (Eigen::Index i = 0; i < expected.size(); ++i)
      EXPECT_NEAR(moved.u[i] - f.fit.u[i], expected[i], slack[i] + 0.15 * expected.norm())
          << nuisances[k].name() << " " << i;
  }
}

TEST(NeverKnown, WidensIntervalsByWhatItTakesThemAlone) {
  Fitted f;
  const FreeParameters parameters(twin_truth());
  const NeverKnown all = never_known_at(f.evaluator, f.model(), f.fit, {});
  const calibration::Uncertainty points = calibration::judge(f.fit, parameters, false),
                                 with = calibration::judge(f.fit, parameters, false, all.shapes_mm);
  const Eigen::MatrixXd sum = points.covariance + with.never_known * with.never_known.transpose();
  EXPECT_LT((with.covariance - sum).norm(), 1e-9 * sum.norm());
  EXPECT_EQ(points.never_known.cols(), 0);
  EXPECT_EQ(points.white, with.white);
  const auto alone = calibration::likelihoods(f.fit, parameters, points, false),
             allowed = calibration::likelihoods(f.fit, parameters, with, false);
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_NEAR(allowed[k]->sd, std::sqrt(with.covariance(i, i)), 1e-9);
    EXPECT_GT(allowed[k]->sd, alone[k]->sd);
  }
}

TEST(NeverKnown, IsSaidInWords) {
  Fitted f;
  for (const std::string& source : never_known_at(f.evaluator, f.model(), f.fit, {}).sources)
    EXPECT_NE(words_of_source(source), source);
  EXPECT_EQ(words_of_source("table"), "table");
}

}  // namespace
}  // namespace supine::diagnosis
