// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace supine {

/// ln Σ exp(logs), without overflow. @pre  at least one, the largest finite
inline double log_sum(const Eigen::Ref<const Eigen::VectorXd>& logs) {
  const double most = logs.maxCoeff();
  return most + std::log((logs.array() - most).exp().sum());
}

}  // namespace supine
