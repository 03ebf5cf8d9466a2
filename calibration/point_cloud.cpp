// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/point_cloud.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

namespace supine::calibration {
namespace {

constexpr int spacing_neighbours = 6;
constexpr double least_root = 1e-3;
constexpr double same_place = 1e-12;  // of the squared spacing: a neighbour there has no direction
constexpr double same_angle = 1e-6;   // a point of a straight border has its neighbours within π up to rounding
// Variance across the neighbours over that along them. Half a disc, a straight border, has 0.28; points spread evenly
// over a surface never less than 0.11.
constexpr double line_share = 0.1;

struct Fit {
  Eigen::Vector3d foot, normal;
  double curvature;
  bool line;  ///< the neighbours lie along one
};

// Paraboloid of revolution over the plane of the neighbours.
Fit fit_surface(const Points& around) {
  const Eigen::RowVector3d centre = around.colwise().mean();
  const Points offset = around.rowwise() - centre;
  const Eigen::Matrix3d scatter = offset.transpose() * offset;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  const Eigen::Matrix3d axes = solver.eigenvectors();
  const Points local = offset * axes;  // height, u, v
  const double reach = local.rightCols<2>().rowwise().norm().maxCoeff();
  const Eigen::ArrayX2d uv = local.rightCols<2>() / reach;  // of order one, for the condition of the fit
  Eigen::MatrixX4d columns(around.rows(), 4);
  columns << Eigen::VectorXd::Ones(around.rows()), uv, 0.5 * uv.square().rowwise().sum();
  const Eigen::Vector4d c = columns.colPivHouseholderQr().solve(local.col(0));
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -c[1] / reach, -c[2] / reach).normalized();
  return {centre.transpose() + axes.col(0) * c[0], axes * normal, c[3] / (reach * reach),
          solver.eigenvalues()[1] < line_share * solver.eigenvalues()[2]};
}

}  // namespace

PointCloud::PointCloud(const Points& points)
    : tree_(points),
      foot_(points.rows(), 3),
      normal_(points.rows(), 3),
      curvature_(points.rows()),
      spacing_mm_(points.rows()) {
  Eigen::Index lines = 0;
#pragma omp parallel for schedule(static) reduction(+ : lines)
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const auto near = tree_.nearest(points.row(i), neighbours + 1);
    Points around(near.size(), 3);
    double sum = 0;
    for (std::size_t k = 0; k < near.size(); ++k) {
      around.row(k) = points.row(near[k].second);
      if (k >= 1 && k <= spacing_neighbours) sum += std::sqrt(near[k].first);
    }
    spacing_mm_[i] = sum / spacing_neighbours;
    const Fit fit = fit_surface(around);
    foot_.row(i) = fit.foot;
    normal_.row(i) = fit.normal;
    curvature_[i] = fit.curvature;
    lines += fit.line;
  }
  contour_ = 2 * lines > points.rows();
  if (contour_) normal_.setZero();
}

bool PointCloud::one_sided(const Eigen::Vector3d& foot, const Eigen::Vector3d& normal) const {
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  std::vector<double> angles;
  for (const auto& [squared, row] : tree_.nearest(foot, neighbours)) {
    const Eigen::Vector3d offset = tree_.points().row(row).transpose() - foot;
    const double x = offset.dot(u), y = offset.dot(v);
    if (x * x + y * y > same_place * spacing_mm_[row] * spacing_mm_[row]) angles.push_back(std::atan2(y, x));
  }
  std::sort(angles.begin(), angles.end());
  double widest_gap = angles.front() + 2 * std::numbers::pi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) widest_gap = std::max(widest_gap, angles[i] - angles[i - 1]);
  return widest_gap > std::numbers::pi - same_angle;
}

PointCloud::Hit PointCloud::closest(const Eigen::Vector3d& query) const {
  const int point = tree_.nearest(query, 1).front().second;
  const Eigen::Vector3d normal = normal_.row(point);
  const Eigen::Vector3d nearest = tree_.points().row(point);
  if (contour_) return {point, nearest, true};
  const Eigen::Vector3d offset = query - nearest;
  const double along_mm = (offset - normal * normal.dot(offset)).norm();
  if (along_mm > reach_spacings * spacing_mm_[point]) return {point, nearest, true};
  // Sphere of curvature k through the foot f: n·w − k/2 |w|² = 0, w from f. Written so that k = 0 is the plane.
  const double k = curvature_[point];
  const Eigen::Vector3d w = query - foot_.row(point).transpose();
  const double level = normal.dot(w) - k / 2 * w.squaredNorm();
  const double root = std::sqrt(std::max(0.0, 1 - 2 * k * level));  // |n − k w|: 0 only at the centre of the sphere
  if (root < least_root) return {point, nearest, false};
  const double height = 2 * level / (1 + root);
  const Eigen::Vector3d foot = query - height / root * (normal - k * w);
  return {point, foot, one_sided(foot, normal)};
}

}  // namespace supine::calibration
