// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/error_budget.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/diagnosis/sheet.h"

namespace supine::diagnosis {
namespace {

/// A sheet that lies @p off_mm off as a whole, of which one parameter could take away all.
struct Shifted {
  Shifted(double off_mm, double tolerance_mm) {
    calibration::Residuals& r = fit.solution.residuals = supine::testing::sheet(7);
    r.distance_mm.array() += off_mm;
    fit.solution.linearisation.slope = (r.place.col(0) / 40).matrix();
    sources.noise_mm = r.sigma_mm;
    sources.mean_mm = Eigen::VectorXd::Zero(r.size());
    sources.modes = {{"chest_wall", Eigen::VectorXd::Constant(r.size(), tolerance_mm)}};
    whitening = Whitening::of(r, sources);
  }
  ErrorBudget budget() const { return error_budget(fit, sources, {&whitening, sources.mean_mm, {}, {}}); }

  WeightedFit fit;
  ErrorSources sources;
  Whitening whitening;
};

TEST(ErrorBudget, AddsUpInSquares) {
  const ErrorBudget b = Shifted(1.5, 0.4).budget();
  const double sum = b.noise * b.noise + b.registration * b.registration + b.numerical * b.numerical +
                     b.parameters * b.parameters + b.model_form * b.model_form;
  EXPECT_NEAR(sum, b.total * b.total, 1e-9);
}

TEST(ErrorBudget, ASourceCountsWithItsToleranceAndTheRestIsTheModels) {
  const ErrorBudget b = Shifted(1.5, 0.4).budget();
  EXPECT_NEAR(b.registration, 0.4, 0.01);
  EXPECT_NEAR(b.model_form, std::sqrt(1.5 * 1.5 - 0.4 * 0.4), 0.1);
  const ErrorBudget known = Shifted(1.5, 1.6).budget();
  EXPECT_NEAR(known.registration, 1.5, 0.05) << "cut at what is there";
  EXPECT_LT(known.model_form, 1e-6);
}

TEST(ErrorBudget, WhatTheFitUnderAllErrorsDoesNotTakeAwayCounts) {
  // A parameter along the very shape that is tolerated: an ordinary fit would have taken the shift away, the one under
  // all errors leaves it to its source.
  Shifted s(1.0, 1.0);
  s.fit.solution.linearisation.slope = Eigen::MatrixXd::Constant(s.fit.solution.residuals.size(), 1, 1.0) +
                                       0.3 * (s.fit.solution.residuals.place.col(0) / 40);
  EXPECT_GT(s.budget().registration, 0.7);
  EXPECT_LT(s.budget().model_form, 0.3);
}

}  // namespace
}  // namespace supine::diagnosis
