// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/field_modes.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace supine::diagnosis {

Points middles(const Points& points, const Indices& nodes, int corners) {
  Points middle = Points::Zero(nodes.rows(), 3);
  for (Eigen::Index e = 0; e < nodes.rows(); ++e)
    for (int a = 0; a < corners; ++a) middle.row(e) += points.row(nodes(e, a)) / corners;
  return middle;
}

std::vector<int> spread_out(const Points& points, int most) {
  std::vector<int> chosen{0};
  Eigen::VectorXd gap = (points.rowwise() - points.row(0)).rowwise().norm();
  while (static_cast<int>(chosen.size()) < most) {
    Eigen::Index next;
    if (!(gap.maxCoeff(&next) > 0)) break;
    chosen.push_back(static_cast<int>(next));
    gap = gap.cwiseMin((points.rowwise() - points.row(next)).rowwise().norm());
  }
  return chosen;
}

Eigen::MatrixXd gaussian_kernel(const Points& a, const Points& b, double length_mm) {
  Eigen::MatrixXd kernel(a.rows(), b.rows());
  const double scale = -0.5 / (length_mm * length_mm);
  for (Eigen::Index c = 0; c < b.rows(); ++c)
    kernel.col(c) = (scale * (a.rowwise() - b.row(c)).rowwise().squaredNorm().array()).exp();
  return kernel;
}

Eigen::MatrixXd field_modes(const Points& points, double length_mm, int most) {
  constexpr int centres_at_most = 300;
  constexpr double share_held = 0.98;
  const Points centres = points(spread_out(points, centres_at_most), Eigen::all);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gaussian_kernel(centres, centres, length_mm));
  const Eigen::VectorXd& variance = eigen.eigenvalues();  // ascending
  const Eigen::Index count = variance.size();
  Eigen::Index kept = 0;
  for (double held = 0; kept < std::min<Eigen::Index>(most, count) && held < share_held * variance.sum(); ++kept)
    held += variance[count - 1 - kept];
  const Eigen::MatrixXd along = eigen.eigenvectors().rightCols(kept).rowwise().reverse();
  const Eigen::VectorXd scale = variance.tail(kept).reverse().cwiseSqrt().cwiseInverse();
  return gaussian_kernel(points, centres, length_mm) * along * scale.asDiagonal();
}

Eigen::MatrixXd without(const Eigen::VectorXd& shape, const Eigen::VectorXd& weight, Eigen::MatrixXd columns) {
  const Eigen::VectorXd weighted = weight.cwiseProduct(shape);
  const Eigen::RowVectorXd share = weighted.transpose() * columns / weighted.dot(shape);
  columns -= shape * share;
  return columns;
}

}  // namespace supine::diagnosis
