// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/error_budget.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace supine::diagnosis {
namespace {

double mean_square(const Eigen::VectorXd& x) { return x.squaredNorm() / static_cast<double>(x.size()); }

/// What an ordinary refit of the parameters leaves of a field.
Eigen::VectorXd left_of(const Eigen::VectorXd& field, const Eigen::MatrixXd& slope) {
  return field - slope * slope.completeOrthogonalDecomposition().solve(field);
}

}  // namespace

ErrorBudget error_budget(const WeightedFit& fit, const ErrorSources& sources, const Metric& metric) {
  const calibration::Fit& f = fit.fit;
  const Eigen::MatrixXd& slope = f.linearisation.slope;
  const double total = mean_square(f.residuals.distance_mm);
  double noise = mean_square(sources.noise_mm), registration = 0, numerical = std::pow(sources.spread_mm, 2);
  numerical += mean_square(left_of(sources.mean_mm, slope));
  for (const ErrorMode& mode : sources.modes)
    (mode.source == "numerical" || mode.source == "mesh" ? numerical : registration) +=
        mean_square(left_of(mode.shape_mm, slope));
  const Eigen::MatrixXd white = metric.whitening->apply(slope);
  const Eigen::MatrixXd covariance = (white.transpose() * white).completeOrthogonalDecomposition().pseudoInverse();
  double parameters = (slope * covariance).cwiseProduct(slope).sum() / static_cast<double>(slope.rows());
  noise = std::min(noise, total);
  const double known = registration + numerical + parameters, share = std::min(1.0, (total - noise) / known);
  if (known > 0) registration *= share, numerical *= share, parameters *= share;
  const double model = std::max(0.0, total - noise - registration - numerical - parameters);
  return {std::sqrt(total),     std::sqrt(noise),      std::sqrt(registration),
          std::sqrt(numerical), std::sqrt(parameters), std::sqrt(model)};
}

}  // namespace supine::diagnosis
