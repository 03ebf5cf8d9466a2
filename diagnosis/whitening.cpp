// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/whitening.h"

#include "common/error.h"

namespace supine::diagnosis {

Whitening Whitening::independent(const calibration::Residuals& residuals) {
  Whitening whitening;
  whitening.sigma_ = residuals.sigma_mm;
  whitening.effective_points_ = static_cast<double>(residuals.size());
  return whitening;
}

Whitening Whitening::given(const calibration::Clusters& clusters, const Eigen::MatrixXd& covariance) {
  Whitening whitening;
  whitening.clusters_ = clusters;
  whitening.effective_points_ = static_cast<double>(clusters.members.size());
  whitening.factor_.compute(covariance);  // reads the lower half
  if (whitening.factor_.info() != Eigen::Success)
    throw NumericalFailure("the covariance of the scan's errors is not positive; are there points twice in the scan?");
  return whitening;
}

Eigen::MatrixXd Whitening::apply(const Eigen::MatrixXd& columns) const {
  if (sigma_.size() > 0) return sigma_.cwiseInverse().asDiagonal() * columns;
  return factor_.matrixL().solve(clusters_.means(columns));
}

}  // namespace supine::diagnosis
