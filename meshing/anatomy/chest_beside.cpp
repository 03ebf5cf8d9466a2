// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/chest_beside.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <map>

#include "meshing/anatomy.h"

namespace supine::meshing {
namespace {

constexpr int harmonics = 6;
constexpr double smoothness = 1e-3;  // of the series: weight of m⁴ times a harmonic's square, per point

/// Nodes of edges that belong to one face of the skin alone.
std::set<int> border_of_skin(const TetMesh& mesh) {
  std::map<std::pair<int, int>, std::pair<int, int>> edges;  // corners → faces that have it, middle node
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (mesh.region[f] != static_cast<int>(reconstruction::Region::skin)) continue;
    for (int k = 0; k < 3; ++k) {
      const auto corners = std::minmax(mesh.faces(f, k), mesh.faces(f, (k + 1) % 3));
      auto& [faces, middle] = edges[corners];
      ++faces;
      middle = mesh.faces.cols() == 6 ? mesh.faces(f, 3 + k) : -1;
    }
  }
  std::set<int> nodes;
  for (const auto& [corners, found] : edges) {
    if (found.first != 1) continue;
    nodes.insert({corners.first, corners.second});
    if (found.second >= 0) nodes.insert(found.second);
  }
  return nodes;
}

Eigen::VectorXd waves(double azimuth) {
  Eigen::VectorXd row(2 * harmonics + 1);
  row[0] = 1;
  for (int m = 1; m <= harmonics; ++m) row[2 * m - 1] = std::cos(m * azimuth), row[2 * m] = std::sin(m * azimuth);
  return row;
}

/// Least squares, the higher harmonics held down: what few or uneven points leave open stays smooth.
Eigen::VectorXd fitted_series(const Eigen::VectorXd& azimuth, const Eigen::VectorXd& value) {
  const int terms = 2 * harmonics + 1;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms, terms);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(terms);
  for (Eigen::Index i = 0; i < azimuth.size(); ++i) {
    const Eigen::VectorXd row = waves(azimuth[i]);
    normal += row * row.transpose();
    right += value[i] * row;
  }
  for (int m = 1; m <= harmonics; ++m)
    for (const int t : {2 * m - 1, 2 * m})
      normal(t, t) += smoothness * std::pow(m, 4) * static_cast<double>(azimuth.size());
  return normal.ldlt().solve(right);
}

Curve series_at(const Eigen::VectorXd& series, double azimuth) {
  Curve at{series[0], 0, 0};
  for (int m = 1; m <= harmonics; ++m) {
    const double c = std::cos(m * azimuth), s = std::sin(m * azimuth);
    const double even = series[2 * m - 1], odd = series[2 * m];
    at.value += even * c + odd * s;
    at.slope += m * (odd * c - even * s);
    at.curvature -= m * m * (even * c + odd * s);
  }
  return at;
}

}  // namespace

std::optional<ChestBeside> chest_beside(const TetMesh& mesh, const Anatomy& anatomy) {
  if (anatomy.is_object()) return std::nullopt;
  const std::set<int> rim = border_of_skin(mesh);
  if (rim.empty()) return std::nullopt;
  return ChestBeside(mesh, anatomy, rim);
}

ChestBeside::ChestBeside(const TetMesh& mesh, const Anatomy& anatomy, const std::set<int>& rim)
    : muscle_(anatomy.muscle) {
  across_ << anatomy.lateral.transpose(), anatomy.head.transpose();
  const auto count = static_cast<Eigen::Index>(rim.size());
  Eigen::Matrix2Xd seen(2, count);
  Eigen::VectorXd azimuth(count), radius(count), height(count);
  Eigen::Index i = 0;
  for (const int node : rim) {
    seen.col(i) = across_ * mesh.points.row(node).transpose();
    height[i++] = muscle_->value(mesh.points.row(node).transpose());
  }
  centre_ = seen.rowwise().mean();
  for (i = 0; i < count; ++i) {
    const Eigen::Vector2d from = seen.col(i) - centre_;
    radius[i] = from.norm();
    azimuth[i] = std::atan2(from.y(), from.x());
  }
  radius_ = fitted_series(azimuth, radius);
  height_ = fitted_series(azimuth, height);
  double outside = 0;
  for (i = 0; i < count; ++i) outside = std::max(outside, radius[i] - series_at(radius_, azimuth[i]).value);
  radius_[0] += outside + margin_mm;
}

ChestBeside::Sample ChestBeside::at(const Eigen::Vector3d& point_mm) const {
  Sample sample;
  const Eigen::Vector2d from = across_ * point_mm - centre_;
  const double distance = from.norm(), azimuth = std::atan2(from.y(), from.x());
  const Curve radius = series_at(radius_, azimuth);
  const double outside = (distance - radius.value) / fade_mm;
  if (!(outside > 0)) return sample;

  const Eigen::Vector2d out = from / distance, along(-out.y(), out.x());
  const Eigen::Vector2d turn = along / distance;  // ∇ azimuth
  const Eigen::Matrix2d turn_hessian = -(along * out.transpose() + out * along.transpose()) / (distance * distance);
  const Eigen::Matrix2d out_hessian = along * along.transpose() / distance;
  const Curve step = smooth_step(outside);
  const Eigen::Vector2d gradient = (out - radius.slope * turn) / fade_mm;
  const Eigen::Matrix2d hessian =
      (out_hessian - radius.curvature * turn * turn.transpose() - radius.slope * turn_hessian) / fade_mm;
  sample.share = step.value;
  sample.share_gradient = across_.transpose() * (step.slope * gradient);
  sample.share_hessian =
      across_.transpose() * (step.curvature * gradient * gradient.transpose() + step.slope * hessian) * across_;

  const Curve height = series_at(height_, azimuth);
  const MuscleDistance::Sample muscle = muscle_->at(point_mm);
  sample.gap_mm = muscle.value_mm - height.value;
  sample.gradient = muscle.gradient - across_.transpose() * (height.slope * turn);
  sample.hessian = muscle.hessian - across_.transpose() *
                                        (height.curvature * turn * turn.transpose() + height.slope * turn_hessian) *
                                        across_;
  return sample;
}

}  // namespace supine::meshing
