// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/spline_basis.h"

#include <algorithm>
#include <cmath>

namespace supine::meshing {
namespace {

// Values and derivatives of the four splines at t in [0, 1] within a knot interval; row = order of the derivative.
Eigen::Matrix4d local_splines(double t) {
  const double s = 1 - t;
  Eigen::Matrix4d b;
  b.row(0) << s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6;
  b.row(1) << -s * s / 2, (3 * t * t - 4 * t) / 2, -(3 * s * s - 4 * s) / 2, t * t / 2;
  b.row(2) << s, 3 * t - 2, 3 * s - 2, t;
  b.row(3) << -1, 3, -3, 1;
  return b;
}

}  // namespace

SplineWeights spline_weights(double u, int size, double knot_mm) {
  const int intervals = size - 3;
  const double inside = std::clamp(u, 0.0, static_cast<double>(intervals));
  SplineWeights w;
  w.first = std::min(static_cast<int>(inside), intervals - 1);
  const double t = inside - w.first, s = 1 - t, past = u - inside;
  const double inverse = 1 / knot_mm;
  const std::array<double, 4> value = {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                                       (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6};
  const std::array<double, 4> slope = {-s * s / 2, (3 * t * t - 4 * t) / 2, -(3 * s * s - 4 * s) / 2, t * t / 2};
  const std::array<double, 4> curvature = {s, 3 * t - 2, 3 * s - 2, t};
  for (int i = 0; i < 4; ++i) {
    w.value[i] = value[i] + past * (slope[i] + past * curvature[i] / 2);
    w.slope[i] = (slope[i] + past * curvature[i]) * inverse;
    w.curvature[i] = curvature[i] * inverse * inverse;
  }
  return w;
}

std::array<Eigen::MatrixXd, 4> spline_gram(int size) {
  // Four-point Gauss rule on [0, 1]: exact to degree 7, the products have 6.
  const double a = std::sqrt(3.0 / 7 - 2.0 / 7 * std::sqrt(6.0 / 5)),
               b = std::sqrt(3.0 / 7 + 2.0 / 7 * std::sqrt(6.0 / 5));
  const double wa = (18 + std::sqrt(30.0)) / 72, wb = (18 - std::sqrt(30.0)) / 72;
  const std::array<std::array<double, 2>, 4> rule = {
      {{(1 - b) / 2, wb}, {(1 - a) / 2, wa}, {(1 + a) / 2, wa}, {(1 + b) / 2, wb}}};
  std::array<Eigen::MatrixXd, 4> gram;
  for (int m = 0; m < 4; ++m) {
    Eigen::Matrix4d block = Eigen::Matrix4d::Zero();
    for (const auto& [t, weight] : rule) {
      const Eigen::Vector4d row = local_splines(t).row(m);
      block += weight * row * row.transpose();
    }
    gram[m] = Eigen::MatrixXd::Zero(size, size);
    for (int i = 0; i + 3 < size; ++i) gram[m].block<4, 4>(i, i) += block;
  }
  return gram;
}

}  // namespace supine::meshing
