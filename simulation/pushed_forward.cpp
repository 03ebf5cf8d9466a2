// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/pushed_forward.h"

#include <Eigen/Dense>
#include <cmath>

namespace supine::simulation {
namespace {

/// The three edges from the first corner, as columns.
Eigen::Matrix3d edges(const Indices& cells, Eigen::Index cell, const Points& shape) {
  Eigen::Matrix3d columns;
  for (int a = 0; a < 3; ++a) columns.col(a) = (shape.row(cells(cell, a + 1)) - shape.row(cells(cell, 0))).transpose();
  return columns;
}

}  // namespace

Points pushed_forward(const Indices& cells, const Points& x, const Points& X, const Points& moved) {
  const Points change = moved - X;
  Points pushed = Points::Zero(x.rows(), 3);
  Eigen::VectorXd volume = Eigen::VectorXd::Zero(x.rows());
  for (Eigen::Index c = 0; c < cells.rows(); ++c) {
    const Eigen::Matrix3d undeformed = edges(cells, c, X);
    const double weight = std::abs(undeformed.determinant());
    if (!(weight > 0)) continue;
    const Eigen::Matrix3d f = edges(cells, c, x) * undeformed.inverse();
    for (Eigen::Index a = 0; a < cells.cols(); ++a) {
      const int node = cells(c, a);
      pushed.row(node) += weight * change.row(node) * f.transpose();
      volume[node] += weight;
    }
  }
  for (Eigen::Index n = 0; n < x.rows(); ++n) {
    const bool held = x.row(n) == X.row(n);
    if (held || !(volume[n] > 0))
      pushed.row(n) = x.row(n) + change.row(n);
    else
      pushed.row(n) = x.row(n) + pushed.row(n) / volume[n];
  }
  return pushed;
}

}  // namespace supine::simulation
