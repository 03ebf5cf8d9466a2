// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/pushed_forward.h"

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

std::vector<Eigen::Matrix3d> nodal_deformation(const Indices& cells, const Points& x, const Points& X) {
  std::vector<Eigen::Matrix3d> f(static_cast<std::size_t>(x.rows()), Eigen::Matrix3d::Zero());
  Eigen::VectorXd volume = Eigen::VectorXd::Zero(x.rows());
  for (Eigen::Index c = 0; c < cells.rows(); ++c) {
    const Eigen::Matrix3d undeformed = edges(cells, c, X);
    const double weight = std::abs(undeformed.determinant());
    if (!(weight > 0)) continue;
    const Eigen::Matrix3d weighted = weight * edges(cells, c, x) * undeformed.inverse();
    for (Eigen::Index a = 0; a < cells.cols(); ++a) {
      f[static_cast<std::size_t>(cells(c, a))] += weighted;
      volume[cells(c, a)] += weight;
    }
  }
  for (Eigen::Index n = 0; n < x.rows(); ++n) {
    Eigen::Matrix3d& at = f[static_cast<std::size_t>(n)];
    if (volume[n] > 0)
      at /= volume[n];
    else
      at.setIdentity();
  }
  return f;
}

Points pushed_forward(const Indices& cells, const Points& x, const Points& X, const Points& moved) {
  const std::vector<Eigen::Matrix3d> f = nodal_deformation(cells, x, X);
  Points pushed = moved - X;
  for (Eigen::Index n = 0; n < x.rows(); ++n) {
    const bool held = x.row(n) == X.row(n);
    if (!held) pushed.row(n) = (pushed.row(n) * f[static_cast<std::size_t>(n)].transpose()).eval();
  }
  return x + pushed;
}

}  // namespace supine::simulation
