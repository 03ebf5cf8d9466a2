// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/chi_squared.h"

#include <cmath>

namespace supine::diagnosis {
namespace {

double normal_above(double z) { return 0.5 * std::erfc(z / std::sqrt(2.0)); }

}  // namespace

double chi_squared_above(int freedom, double value) {
  if (freedom < 1 || value <= 0) return 1;
  const double c = 2 / (9.0 * freedom);
  return normal_above((std::cbrt(value / freedom) - (1 - c)) / std::sqrt(c));
}

double chi_squared_power(int freedom, double lambda) {
  const double q = freedom, c = 2 / (9 * q);
  const double quantile = q * std::pow(1 - c + 1.644854 * std::sqrt(c), 3);
  const double a = q + lambda, b = q + 2 * lambda;
  const double h = 1 - 2 * a * (q + 3 * lambda) / (3 * b * b), p = b / (a * a), m = (h - 1) * (1 - 3 * h);
  const double mean = 1 + h * p * (h - 1 - 0.5 * (2 - h) * m * p), sd = h * std::sqrt(2 * p) * (1 + 0.5 * m * p);
  return normal_above((std::pow(quantile / a, h) - mean) / sd);
}

}  // namespace supine::diagnosis
