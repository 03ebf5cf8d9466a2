// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/whitening.h"

#include <cmath>

#include "common/error.h"

namespace supine::diagnosis {

Whitening Whitening::independent(const calibration::Residuals& residuals) {
  Whitening whitening;
  whitening.sigma_ = residuals.sigma_mm;
  whitening.effective_points_ = static_cast<double>(residuals.size());
  return whitening;
}

Whitening Whitening::correlated(const calibration::Residuals& residuals, const calibration::ErrorModel& errors,
                                Eigen::Index most) {
  Whitening whitening;
  whitening.clusters_ = calibration::cluster_points(residuals, most);
  const calibration::Clusters& clusters = whitening.clusters_;
  const double nugget = errors.nugget_mm * errors.nugget_mm, shared = errors.spread_mm * errors.spread_mm;
  const Eigen::Index count = clusters.members.size();
  Eigen::MatrixXd sigma = Eigen::MatrixXd::Zero(count, count);
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < count; ++i) {
    sigma(i, i) = nugget / clusters.members[i] + shared;
    for (Eigen::Index j = 0; j < i; ++j)
      if (clusters.pose[i] == clusters.pose[j])
        sigma(i, j) = shared * std::exp(-(clusters.place.row(i) - clusters.place.row(j)).norm() / errors.length_mm);
  }
  whitening.factor_.compute(sigma);  // reads the lower half
  if (whitening.factor_.info() != Eigen::Success)
    throw NumericalFailure("the covariance of the scan's errors is not positive; are there points twice in the scan?");
  whitening.effective_points_ = errors.effective_count(residuals);
  return whitening;
}

Eigen::MatrixXd Whitening::apply(const Eigen::MatrixXd& columns) const {
  if (sigma_.size() > 0) return sigma_.cwiseInverse().asDiagonal() * columns;
  return factor_.matrixL().solve(clusters_.means(columns));
}

}  // namespace supine::diagnosis
