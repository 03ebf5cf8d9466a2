// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "calibration/error_model.h"
#include "diagnosis/error_sources.h"

namespace supine::diagnosis {

/// Turns columns over the residuals' points into ones whose errors are independent with variance 1: L⁻¹ a with
/// Σ = L Lᵀ, a the points' values or means over clusters of them.
class Whitening {
 public:
  /// Every point errs by itself, by sigma_mm of the residuals. All points are kept.
  static Whitening independent(const calibration::Residuals& residuals);
  /// Σ of an error model, on the means of at most @p most clusters of points (a dense factorisation).
  static Whitening correlated(const calibration::Residuals& residuals, const calibration::ErrorModel& errors,
                              Eigen::Index most = 900);

  /// Σ of all sources, on the means of clusters. effective_points() is that of noise and spread, without the modes.
  static Whitening of(const calibration::Residuals& residuals, const ErrorSources& sources, Eigen::Index most = 600);

  Eigen::MatrixXd apply(const Eigen::MatrixXd& columns) const;
  /// Independent points these errors are worth, (tr Σ)²/tr(Σ²), of all the residuals.
  double effective_points() const { return effective_points_; }
  /// What apply() averages over; without clusters when points are independent.
  const calibration::Clusters& clusters() const { return clusters_; }

 private:
  /// @param spread_mm  of each cluster
  void factorise(const Eigen::VectorXd& nugget, const Eigen::VectorXd& spread_mm, double length_mm,
                 const Eigen::MatrixXd& modes);

  Eigen::VectorXd sigma_;               // independent
  calibration::Clusters clusters_;      // correlated
  Eigen::LLT<Eigen::MatrixXd> factor_;  // correlated
  double effective_points_ = 0;
};

}  // namespace supine::diagnosis
