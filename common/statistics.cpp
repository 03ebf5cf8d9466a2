// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/statistics.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/complement.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>

namespace supine {

using boost::math::chi_squared;
using boost::math::complement;

double quantile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double place = p * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], place - static_cast<double>(below));
}

double median(const Eigen::VectorXd& values) { return quantile({values.begin(), values.end()}, 0.5); }

double normal_quantile(double p) { return boost::math::quantile(boost::math::normal(), p); }

double chi_squared_quantile(int freedom, double p) { return boost::math::quantile(chi_squared(freedom), p); }

double chi_squared_above(int freedom, double value) {
  if (freedom < 1 || value <= 0) return 1;
  return boost::math::cdf(complement(chi_squared(freedom), value));
}

double chi_squared_power(int freedom, double lambda, double value) {
  if (freedom < 1) return 0;
  if (lambda <= 0) return chi_squared_above(freedom, value);
  constexpr double certain = 1e4;  // beyond it the series needs many terms and the chance is 1 to every digit
  if (lambda > certain + value) return 1;
  return boost::math::cdf(complement(boost::math::non_central_chi_squared(freedom, lambda), std::max(0.0, value)));
}

Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd& columns) {
  if (columns.cols() == 0) return columns;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
}

}  // namespace supine
