// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/noise.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "calibration/statistics.h"
#include "common/error.h"

namespace supine::calibration {
namespace {

constexpr int neighbours = 16;
constexpr Eigen::Index most_queries = 3000;
constexpr Eigen::Index least_points = 40;
constexpr double mad_to_sigma = 1.482602;  // of a normal law

std::vector<int> nearest(const Points& place, Eigen::Index query) {
  const Eigen::VectorXd distance = (place.rowwise() - place.row(query)).rowwise().squaredNorm();
  std::vector<int> order(static_cast<std::size_t>(place.rows()));
  std::iota(order.begin(), order.end(), 0);
  const auto closer = [&distance](int a, int b) {
    return distance[a] != distance[b] ? distance[a] < distance[b] : a < b;
  };
  std::nth_element(order.begin(), order.begin() + neighbours, order.end(), closer);
  order.resize(neighbours + 1);
  std::sort(order.begin(), order.end(), closer);
  order.erase(order.begin());  // the point itself
  return order;
}

/// Deviation of the point from the plane through its neighbours' distances, in units of the noise of one point.
double standardised_deviation(const Points& place, const Eigen::VectorXd& distance_mm, Eigen::Index query) {
  const std::vector<int> around = nearest(place, query);
  Eigen::Matrix<double, neighbours, 3> arm;
  Eigen::Matrix<double, neighbours, 1> d;
  for (int k = 0; k < neighbours; ++k) {
    arm.row(k) = place.row(around[static_cast<std::size_t>(k)]) - place.row(query);
    d[k] = distance_mm[around[static_cast<std::size_t>(k)]];
  }
  const Eigen::JacobiSVD<Eigen::Matrix<double, neighbours, 3>> svd(arm, Eigen::ComputeFullV);
  Eigen::Matrix<double, neighbours, 3> design;  // 1, and the two directions of the surface
  design.col(0).setOnes();
  design.rightCols<2>() = arm * svd.matrixV().leftCols<2>();
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, neighbours, 3>> qr(design);
  const double predicted = qr.solve(d)[0];
  const Eigen::Matrix3d inverse = (design.transpose() * design).ldlt().solve(Eigen::Matrix3d::Identity());
  return (distance_mm[query] - predicted) / std::sqrt(1 + inverse(0, 0));
}

}  // namespace

double estimate_noise_mm(const Points& place, const Eigen::VectorXd& distance_mm) {
  if (place.rows() < least_points)
    throw InputError(fmt::format("the noise cannot be estimated from {} points (least {}); give noise_mm", place.rows(),
                                 least_points));
  const Eigen::Index stride = (place.rows() + most_queries - 1) / most_queries;
  std::vector<double> deviation(static_cast<std::size_t>((place.rows() + stride - 1) / stride));
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < deviation.size(); ++i)
    deviation[i] = std::abs(standardised_deviation(place, distance_mm, static_cast<Eigen::Index>(i) * stride));
  return mad_to_sigma * percentile(deviation, 0.5);
}

}  // namespace supine::calibration
