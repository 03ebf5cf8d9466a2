// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/error_budget.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/rms.h"
#include "common/statistics.h"

namespace supine::diagnosis {
namespace {

/// What the fit under all errors leaves of a field.
class LeftByFit {
 public:
  LeftByFit(const Eigen::MatrixXd& slope, const Whitening& whitening)
      : slope_(slope), white_(whitening.apply(slope)), whitening_(whitening) {
    covariance_ = covariance_of(white_.transpose() * white_);
  }

  double mean_square_of(const Eigen::VectorXd& field) const {
    return mean_square(field - slope_ * (covariance_ * (white_.transpose() * whitening_.apply(field))));
  }

  const Eigen::MatrixXd& covariance() const { return covariance_; }

 private:
  const Eigen::MatrixXd& slope_;
  Eigen::MatrixXd white_, covariance_;
  const Whitening& whitening_;
};

}  // namespace

ErrorBudget error_budget(const WeightedFit& fit, const ErrorSources& sources, const Metric& metric) {
  const calibration::Fit& f = fit.solution;
  const Eigen::MatrixXd& slope = f.linearisation.slope;
  const LeftByFit left(slope, *metric.whitening);
  const double total = mean_square(f.residuals.distance_mm);
  double noise = mean_square(sources.noise_mm), registration = 0;
  double numerical = std::pow(sources.spread_mm, 2) + mean_square(sources.mean_mm);
  for (const ErrorMode& mode : sources.modes)
    (mode.source == "numerical" || mode.source == "mesh" ? numerical : registration) +=
        left.mean_square_of(mode.shape_mm);
  double parameters = (slope * left.covariance()).cwiseProduct(slope).sum() / static_cast<double>(slope.rows());
  noise = std::min(noise, total);
  const double known = registration + numerical + parameters, share = std::min(1.0, (total - noise) / known);
  if (known > 0) registration *= share, numerical *= share, parameters *= share;
  const double model = std::max(0.0, total - noise - registration - numerical - parameters);
  return {std::sqrt(total),     std::sqrt(noise),      std::sqrt(registration),
          std::sqrt(numerical), std::sqrt(parameters), std::sqrt(model)};
}

}  // namespace supine::diagnosis
