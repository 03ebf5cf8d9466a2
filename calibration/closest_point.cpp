// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/closest_point.h"

namespace supine::calibration {
namespace {

constexpr double weight_zero = 1e-9;

Eigen::Vector3d raw_weights(const Eigen::Vector3d& query, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a;
  const Eigen::Vector3d ap = query - a, bp = query - b, cp = query - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 / (d1 - d3);
    return {1 - t, t, 0};
  }
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 / (d2 - d6);
    return {1 - t, 0, t};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

}  // namespace

TrianglePoint closest_on_triangle(const Eigen::Vector3d& query, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c) {
  Eigen::Vector3d weight = raw_weights(query, a, b, c);
  int zeros = 0;
  for (double& w : weight) {
    if (w < weight_zero) w = 0;
    zeros += w == 0;
  }
  weight /= weight.sum();
  if (zeros == 0) return {weight, Feature::face, 0};
  int corner = 0;
  if (zeros == 2) {
    weight.maxCoeff(&corner);
    return {weight, Feature::vertex, corner};
  }
  weight.minCoeff(&corner);
  return {weight, Feature::edge, (corner + 1) % 3};
}

}  // namespace supine::calibration
