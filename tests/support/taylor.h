// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>

namespace supine::testing {

/// Smallest order at which |f(h) - f(0) - h slope| shrinks as h halves, for a vector- or scalar-valued f of the step h:
/// 2 when slope is the derivative, 1 when it is not. The caller makes sure that the slope is not zero and f not linear.
template <class F, class Slope>
double taylor_order(const F& f, const Slope& slope, double h = 1e-2, int halvings = 4) {
  const auto size = [](const auto& value) {
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>)
      return std::abs(value);
    else
      return value.norm();
  };
  const auto base = f(0.0);
  const auto remainder = [&](double s) { return size((f(s) - base - s * slope)); };
  double order = 1e300, previous = remainder(h);
  for (int i = 0; i < halvings; ++i) {
    h /= 2;
    const double now = remainder(h);
    if (!(now > 0) || !std::isfinite(previous)) return -1e300;  // not a number, or nothing to measure
    order = std::min(order, std::log2(previous / now));
    previous = now;
  }
  return order;
}

/// Seeded numbers in [-1, 1], #rows by #columns.
inline Eigen::MatrixXd random_matrix(int rows, int columns, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::MatrixXd m(rows, columns);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) m(i, j) = uniform(generator);
  return m;
}

}  // namespace supine::testing
