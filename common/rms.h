// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace supine {

/// 0 of nothing.
inline double mean_square(const Eigen::VectorXd& values) {
  return values.size() > 0 ? values.squaredNorm() / static_cast<double>(values.size()) : 0;
}

inline double rms(const Eigen::VectorXd& values) { return std::sqrt(mean_square(values)); }

}  // namespace supine
