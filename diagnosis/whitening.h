// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "calibration/error_model.h"

namespace supine::diagnosis {

/// Turns columns over the residuals' points into ones whose errors are independent with variance 1: L⁻¹ a with
/// Σ = L Lᵀ, a the points' values or means over clusters of them.
class Whitening {
 public:
  /// Every point errs by itself, by sigma_mm of the residuals. All points are kept.
  static Whitening independent(const calibration::Residuals& residuals);
  /// A covariance of clusters' means as it is, #clusters by #clusters, mm². effective_points() is their number.
  static Whitening given(const calibration::Clusters& clusters, const Eigen::MatrixXd& covariance);

  Eigen::MatrixXd apply(const Eigen::MatrixXd& columns) const;
  /// Independent points these errors are worth, (tr Σ)²/tr(Σ²), of all the residuals.
  double effective_points() const { return effective_points_; }
  /// What apply() averages over; without clusters when points are independent.
  const calibration::Clusters& clusters() const { return clusters_; }

 private:
  Eigen::VectorXd sigma_;               // independent
  calibration::Clusters clusters_;      // correlated
  Eigen::LLT<Eigen::MatrixXd> factor_;  // correlated
  double effective_points_ = 0;
};

}  // namespace supine::diagnosis
