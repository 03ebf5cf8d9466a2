// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/fit_errors.h"

namespace supine::diagnosis {

FitErrors::FitErrors(const BaseFit& base, const std::vector<Nuisance>& nuisances, double size_mm) {
  Eigen::MatrixXd sigma = base.errors + size_mm * size_mm * base.kernel;
  Eigen::VectorXd mean = base.mean_mm;
  for (const Nuisance& nuisance : nuisances) {
    const Eigen::VectorXd shape = base.clusters.means(nuisance.shape_mm);
    sigma += shape * shape.transpose();
    mean -= nuisance.value * nuisance.shape_mm;
  }
  whitening_ = Whitening::given(base.clusters, sigma);
  metric_ = {&whitening_, mean, base.fit.mask, base.noise_mm};
}

}  // namespace supine::diagnosis
