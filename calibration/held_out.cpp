// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/held_out.h"

#include <Eigen/Dense>
#include <limits>

#include "calibration/error_model.h"

namespace supine::calibration {
namespace {

constexpr int most_rounds = 100;

/// The point furthest from the centre of all, then each time the one furthest from those taken.
Table far_centres(const Table& q, const std::vector<int>& order, int count) {
  Table centres(count, 2);
  Eigen::RowVector2d mean = Eigen::RowVector2d::Zero();
  for (const int row : order) mean += q.row(row) / static_cast<double>(order.size());
  Eigen::VectorXd distance = (q.rowwise() - mean).rowwise().squaredNorm();
  for (int c = 0; c < count; ++c) {
    int furthest = order[0];
    for (const int row : order)
      if (distance[row] > distance[furthest]) furthest = row;
    centres.row(c) = q.row(furthest);
    const Eigen::VectorXd to_new = (q.rowwise() - centres.row(c)).rowwise().squaredNorm();
    distance = c == 0 ? to_new : distance.cwiseMin(to_new).eval();
  }
  return centres;
}

Eigen::VectorXi closest_centres(const Table& q, const Table& centres) {
  Eigen::VectorXi block(q.rows());
  for (Eigen::Index i = 0; i < q.rows(); ++i)
    (centres.rowwise() - q.row(i)).rowwise().squaredNorm().minCoeff(&block[i]);
  return block;
}

}  // namespace

Eigen::VectorXi spatial_blocks(const Residuals& residuals, int count) {
  const std::vector<int> order = order_by_place(residuals);
  Table centres = far_centres(residuals.q, order, count);
  Eigen::VectorXi block = closest_centres(residuals.q, centres);
  for (int round = 0; round < most_rounds; ++round) {
    Table sum = Table::Zero(count, 2);
    Eigen::VectorXd members = Eigen::VectorXd::Zero(count);
    for (const int row : order) {
      sum.row(block[row]) += residuals.q.row(row);
      ++members[block[row]];
    }
    for (int c = 0; c < count; ++c)
      if (members[c] > 0) centres.row(c) = sum.row(c) / members[c];
    const Eigen::VectorXi next = closest_centres(residuals.q, centres);
    if (next == block) break;
    block = next;
  }
  return block;
}

Eigen::VectorXd held_out_distances(const Residuals& residuals, const Eigen::MatrixXd& slope,
                                   const Eigen::VectorXd& priors, const Eigen::VectorXi& blocks) {
  const Eigen::VectorXd weight = residuals.sigma_mm.cwiseAbs2().cwiseInverse();
  Eigen::VectorXd predicted = residuals.distance_mm;
  for (int block = 0; block <= blocks.maxCoeff(); ++block) {
    const Eigen::VectorXd kept = (blocks.array() != block).select(weight, 0.0);
    // At the optimum the gradient of the whole, priors included, is zero (up to robust weights): what is left of it
    // without the block is that of the points alone.
    const Eigen::VectorXd full = slope.transpose() * weight.cwiseProduct(residuals.distance_mm);
    const Eigen::VectorXd gradient = slope.transpose() * kept.cwiseProduct(residuals.distance_mm) - full;
    Eigen::MatrixXd information = slope.transpose() * kept.asDiagonal() * slope;
    information.diagonal() += priors;
    const Eigen::VectorXd step = -information.completeOrthogonalDecomposition().solve(gradient);
    for (Eigen::Index i = 0; i < blocks.size(); ++i)
      if (blocks[i] == block) predicted[i] += slope.row(i).dot(step);
  }
  return predicted;
}

}  // namespace supine::calibration
