// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/conditioned.h"

#include <Eigen/Cholesky>

#include "common/error.h"
#include "common/statistics.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double least_probability = 0.005;  // sizes less likely than this change nothing

MatrixXd data_covariance(const JointMoves& m, double size) {
  const VectorXd variance = m.sd.cwiseAbs2();
  return m.data_errors + size * size * m.data_kernel + m.data * variance.asDiagonal() * m.data.transpose();
}

Eigen::LLT<MatrixXd> factorised(const MatrixXd& covariance) {
  Eigen::LLT<MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success)
    throw NumericalFailure("the covariance of the measured distances is not positive; are two measurements the same?");
  return factor;
}

/// Targets and directions stacked: t, then θ.
struct Stacked {
  VectorXd mean;
  MatrixXd covariance;
};

Stacked before(const JointMoves& m, double size) {
  const Index t = m.targets.rows(), z = m.sd.size();
  const VectorXd variance = m.sd.cwiseAbs2();
  Stacked s{VectorXd(t + z), MatrixXd(t + z, t + z)};
  s.mean << m.targets * m.mean, m.mean;
  s.covariance.topLeftCorner(t, t) = m.targets * variance.asDiagonal() * m.targets.transpose() +
                                     m.target_patches * m.target_patches.transpose() + size * size * m.target_kernel +
                                     m.target_errors;
  s.covariance.topRightCorner(t, z) = m.targets * variance.asDiagonal();
  s.covariance.bottomLeftCorner(z, t) = s.covariance.topRightCorner(t, z).transpose();
  s.covariance.bottomRightCorner(z, z) = variance.asDiagonal();
  return s;
}

Stacked after(const JointMoves& m, double size) {
  Stacked s = before(m, size);
  if (m.y.size() == 0) return s;
  const Index t = m.targets.rows(), z = m.sd.size();
  const VectorXd variance = m.sd.cwiseAbs2();
  MatrixXd cross(t + z, m.y.size());
  cross.topRows(t) = -(m.targets * variance.asDiagonal() * m.data.transpose() +
                       m.target_patches * m.data_patches.transpose() + size * size * m.cross_kernel);
  cross.bottomRows(z) = -(variance.asDiagonal() * m.data.transpose());
  const auto factor = factorised(data_covariance(m, size));
  const MatrixXd gain = factor.solve(cross.transpose()).transpose();
  s.mean += gain * (m.y + m.data * m.mean);
  s.covariance -= gain * cross.transpose();
  return s;
}

}  // namespace

ConditionedTargets condition(const JointMoves& m) {
  const Index t = m.targets.rows(), z = m.sd.size();
  VectorXd mean = VectorXd::Zero(t + z);
  MatrixXd second = MatrixXd::Zero(t + z, t + z);
  double whole = 0;
  for (Index b = 0; b < m.sizes_mm.size(); ++b) {
    const double p = m.size_probability[b];
    if (p < least_probability) continue;
    const Stacked s = after(m, m.sizes_mm[b]);
    whole += p;
    mean += p * s.mean;
    second += p * (s.covariance + s.mean * s.mean.transpose());
  }
  mean /= whole;
  const MatrixXd covariance = second / whole - mean * mean.transpose();
  return {mean.head(t), covariance.topLeftCorner(t, t), covariance.topRightCorner(t, z), mean.tail(z),
          covariance.bottomRightCorner(z, z)};
}

MatrixXd covariance_after(const JointMoves& m, double size_mm) {
  const Index t = m.targets.rows();
  return after(m, size_mm).covariance.topLeftCorner(t, t);
}

Surprise surprise_of(const JointMoves& m, const std::vector<int>& rows) {
  std::vector<int> others;
  for (int i = 0, k = 0; i < m.y.size(); ++i) {
    if (k < static_cast<int>(rows.size()) && rows[static_cast<std::size_t>(k)] == i)
      ++k;
    else
      others.push_back(i);
  }
  const auto n = static_cast<Index>(rows.size());
  VectorXd mean = VectorXd::Zero(n);
  MatrixXd second = MatrixXd::Zero(n, n);
  double whole = 0;
  const VectorXd expected = -m.data * m.mean;
  for (Index b = 0; b < m.sizes_mm.size(); ++b) {
    const double p = m.size_probability[b];
    if (p < least_probability) continue;
    const MatrixXd all = data_covariance(m, m.sizes_mm[b]);
    VectorXd there = expected(rows);
    MatrixXd covariance = all(rows, rows);
    if (!others.empty()) {
      const MatrixXd cross = all(rows, others);
      const MatrixXd gain = factorised(all(others, others)).solve(cross.transpose()).transpose();
      there += gain * (m.y(others) - expected(others));
      covariance -= gain * cross.transpose();
    }
    whole += p;
    mean += p * there;
    second += p * (covariance + there * there.transpose());
  }
  mean /= whole;
  const MatrixXd covariance = second / whole - mean * mean.transpose();
  Surprise surprise{covariance.diagonal().cwiseSqrt(), m.y(rows) - mean, covariance};
  surprise.square = surprise.less_expected.dot(factorised(covariance).solve(surprise.less_expected));
  surprise.p_value = chi_squared_above(static_cast<int>(n), surprise.square);
  return surprise;
}

}  // namespace supine::diagnosis
