// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/weighted_fit.h"

namespace supine::diagnosis {

/// All that keeps distances from zero at a fit, as one covariance: errors, some nuisances, a discrepancy of one size.
class FitErrors {
 public:
  /// @param nuisances  of the base fit that count; the model has them at their values, their prior stands at zero
  FitErrors(const BaseFit& base, const std::vector<Nuisance>& nuisances, double size_mm);
  FitErrors(const FitErrors&) = delete;
  FitErrors& operator=(const FitErrors&) = delete;

  const Whitening& whitening() const { return whitening_; }
  const Metric& metric() const { return metric_; }  ///< points into this object

 private:
  Whitening whitening_;
  Metric metric_;
};

}  // namespace supine::diagnosis
