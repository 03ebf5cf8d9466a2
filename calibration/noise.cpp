// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/noise.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "calibration/neighbour_search.h"
#include "common/error.h"
#include "common/statistics.h"

namespace supine::calibration {
namespace {

constexpr int neighbours = 16;
constexpr Eigen::Index most_queries = 3000;
constexpr Eigen::Index least_points = 40;
constexpr double mad_to_sigma = 1.482602;  // of a normal law

std::vector<int> others_near(const NeighbourSearch& search, Eigen::Index query) {
  std::vector<int> around;
  for (const auto& [squared, row] : search.nearest(search.points().row(query), neighbours + 1))
    if (row != query) around.push_back(row);
  around.resize(neighbours);  // a point in the very same place may stand before the point itself
  return around;
}

void check_count(const Points& place) {
  if (place.rows() < least_points)
    throw InputError(fmt::format("the noise cannot be estimated from {} points (least {}); give noise_mm", place.rows(),
                                 least_points));
}

/// Deviation of the point from the plane through its neighbours' distances, in units of the noise of one point.
double standardised_deviation(const NeighbourSearch& search, const Eigen::VectorXd& distance_mm, Eigen::Index query) {
  const Points& place = search.points();
  const std::vector<int> around = others_near(search, query);
  Eigen::Matrix<double, neighbours, 3> arm;
  Eigen::Matrix<double, neighbours, 1> d;
  for (int k = 0; k < neighbours; ++k) {
    arm.row(k) = place.row(around[static_cast<std::size_t>(k)]) - place.row(query);
    d[k] = distance_mm[around[static_cast<std::size_t>(k)]];
  }
  // Directions of the neighbours among themselves: the point in question may stand off them.
  const Eigen::Matrix<double, neighbours, 3> centred = arm.rowwise() - arm.colwise().mean();
  const Eigen::JacobiSVD<Eigen::Matrix<double, neighbours, 3>> svd(centred, Eigen::ComputeFullV);
  Eigen::Matrix<double, neighbours, 3> design;  // 1, and the two directions of the surface
  design.col(0).setOnes();
  design.rightCols<2>() = arm * svd.matrixV().leftCols<2>();
  // Neighbours may all lie on one line, as places on a ridge of the skin do.
  const Eigen::Matrix<double, 1, neighbours> share = design.completeOrthogonalDecomposition().pseudoInverse().row(0);
  return (distance_mm[query] - share.dot(d)) / std::sqrt(1 + share.squaredNorm());
}

}  // namespace

double estimate_noise_mm(const Points& place, const Eigen::VectorXd& distance_mm) {
  check_count(place);
  const NeighbourSearch search(place);
  const Eigen::Index stride = (place.rows() + most_queries - 1) / most_queries;
  std::vector<double> deviation(static_cast<std::size_t>((place.rows() + stride - 1) / stride));
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < deviation.size(); ++i)
    deviation[i] = std::abs(standardised_deviation(search, distance_mm, static_cast<Eigen::Index>(i) * stride));
  return mad_to_sigma * quantile(deviation, 0.5);
}

std::vector<int> points_that_stand_out(const Points& place, const Eigen::VectorXd& distance_mm, double noise_mm,
                                       double sigmas) {
  check_count(place);
  const NeighbourSearch search(place);
  Eigen::VectorXd deviation(place.rows());
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < deviation.size(); ++i) deviation[i] = standardised_deviation(search, distance_mm, i);
  std::vector<int> rows;
  for (Eigen::Index i = 0; i < deviation.size(); ++i)
    if (std::abs(deviation[i]) > sigmas * noise_mm) rows.push_back(static_cast<int>(i));
  return rows;
}

}  // namespace supine::calibration
