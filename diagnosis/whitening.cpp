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
  whitening.factorise(errors.nugget_mm * errors.nugget_mm * clusters.members.cwiseInverse(),
                      Eigen::VectorXd::Constant(clusters.members.size(), errors.spread_mm), errors.length_mm, {});
  whitening.effective_points_ = errors.effective_count(residuals);
  return whitening;
}

Whitening Whitening::of(const calibration::Residuals& residuals, const ErrorSources& sources, Eigen::Index most) {
  Whitening whitening;
  whitening.clusters_ = calibration::cluster_points(residuals, most);
  const calibration::Clusters& clusters = whitening.clusters_;
  const Eigen::VectorXd variance = clusters.means(sources.noise_mm.cwiseAbs2());
  Eigen::MatrixXd modes(residuals.size(), static_cast<Eigen::Index>(sources.modes.size()));
  for (std::size_t m = 0; m < sources.modes.size(); ++m)
    modes.col(static_cast<Eigen::Index>(m)) = sources.modes[m].shape_mm;
  const Eigen::VectorXd share =
      sources.share.size() > 0 ? sources.share : Eigen::VectorXd::Ones(residuals.size()).eval();
  whitening.factorise(variance.cwiseQuotient(clusters.members), sources.spread_mm * clusters.means(share),
                      sources.length_mm, clusters.means(modes));
  const calibration::ErrorModel errors{std::sqrt(variance.mean()), sources.spread_mm, sources.length_mm};
  whitening.effective_points_ = errors.effective_count(residuals);
  return whitening;
}

void Whitening::factorise(const Eigen::VectorXd& nugget, const Eigen::VectorXd& spread_mm, double length_mm,
                          const Eigen::MatrixXd& modes) {
  const Eigen::Index count = nugget.size();
  Eigen::MatrixXd sigma = Eigen::MatrixXd::Zero(count, count);
  if (modes.size() > 0) sigma.noalias() = modes * modes.transpose();
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < count; ++i) {
    sigma(i, i) += nugget[i] + spread_mm[i] * spread_mm[i];
    for (Eigen::Index j = 0; j < i; ++j)
      if (clusters_.pose[i] == clusters_.pose[j])
        sigma(i, j) += spread_mm[i] * spread_mm[j] *
                       std::exp(-(clusters_.place.row(i) - clusters_.place.row(j)).norm() / length_mm);
  }
  factor_.compute(sigma);  // reads the lower half
  if (factor_.info() != Eigen::Success)
    throw NumericalFailure("the covariance of the scan's errors is not positive; are there points twice in the scan?");
}

Eigen::MatrixXd Whitening::apply(const Eigen::MatrixXd& columns) const {
  if (sigma_.size() > 0) return sigma_.cwiseInverse().asDiagonal() * columns;
  return factor_.matrixL().solve(clusters_.means(columns));
}

}  // namespace supine::diagnosis
