// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/targets/conditioned.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <random>

#include "common/error.h"
#include "common/statistics.h"
#include "diagnosis/evidence/linear_evidence.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double most_probability =
    0.999;                              // what the likeliest sets and sizes hold together: the others change nothing
constexpr int draws_of_mixture = 4000;  // the 95 % quantile to about 3 %, the half axes to half of that

Eigen::LLT<MatrixXd> factorised(const MatrixXd& covariance) {
  Eigen::LLT<MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success)
    throw NumericalFailure("the covariance of the measured distances is not positive; are two measurements the same?");
  return factor;
}

/// θ of one set and t, after the measurement.
struct Posterior {
  VectorXd directions, targets;
  MatrixXd of_directions, of_targets, with_directions;
};

/// θ_k has no values below @p least: moments of the normal that is cut there, and of what goes with it.
void cut(Posterior& p, Index k, double least) {
  const double variance = p.of_directions(k, k), sd = std::sqrt(variance), a = (least - p.directions[k]) / sd;
  constexpr double far = 6;  // further out the density falls like an exponential
  const double above = 0.5 * std::erfc(a / std::numbers::sqrt2);
  const double ratio = a > far ? a + 1 / a : std::exp(-0.5 * a * a) / std::sqrt(2 * std::numbers::pi) / above;
  const double left = a > far ? 1 / (a * a) : 1 + ratio * (a - ratio);
  const VectorXd gain = p.of_directions.col(k) / variance, target_gain = p.with_directions.col(k) / variance;
  p.directions += sd * ratio * gain;
  p.targets += sd * ratio * target_gain;
  p.of_directions += variance * (left - 1) * gain * gain.transpose();
  p.of_targets += variance * (left - 1) * target_gain * target_gain.transpose();
  p.with_directions += variance * (left - 1) * target_gain * gain.transpose();
}

/// All at one size s that is the same for every set: with Σ the covariance of what no direction makes of the distances
/// and X that of the places with it, t = T θ − X Σ⁻¹ (y + C θ) and a rest.
class AtSize {
 public:
  AtSize(const JointMoves& m, double size) : m_(m), targets_(m.targets) {
    rest_ = m.target_patches * m.target_patches.transpose() + size * size * m.target_kernel + m.target_errors;
    const Index z = m.sd.size();
    gram_ = MatrixXd::Zero(z, z), gradient_ = VectorXd::Zero(z), offset_ = VectorXd::Zero(m.targets.rows());
    if (m.data.rows() == 0) return;
    const auto factor = factorised(m.data_errors + size * size * m.data_kernel);
    const MatrixXd cross = m.target_patches * m.data_patches.transpose() + size * size * m.cross_kernel;
    const MatrixXd half_data = factor.matrixL().solve(m.data), half_cross = factor.matrixL().solve(cross.transpose());
    gram_ = half_data.transpose() * half_data;
    targets_ += -half_cross.transpose() * half_data;
    rest_ -= half_cross.transpose() * half_cross;
    if (m.y.size() == 0) return;
    const VectorXd half_y = factor.matrixL().solve(m.y);
    gradient_ = half_data.transpose() * half_y;
    offset_ = -half_cross.transpose() * half_y;
  }

  Posterior of(const std::vector<int>& rows) const {
    const VectorXd information = m_.sd(rows).cwiseAbs2().cwiseInverse();
    MatrixXd a = gram_(rows, rows);
    a.diagonal() += information;
    const auto root = factorised(a);
    const MatrixXd columns = targets_(Eigen::all, rows);
    Posterior p;
    p.directions = root.solve(information.cwiseProduct(m_.mean(rows)) - gradient_(rows));
    p.of_directions = root.solve(MatrixXd::Identity(a.rows(), a.cols()));
    p.targets = offset_ + columns * p.directions;
    p.with_directions = columns * p.of_directions;
    p.of_targets = rest_ + p.with_directions * columns.transpose();
    for (std::size_t k = 0; k < rows.size() && m_.least.size() > 0; ++k)
      if (std::isfinite(m_.least[rows[k]])) cut(p, static_cast<Index>(k), m_.least[rows[k]]);
    return p;
  }

 private:
  const JointMoves& m_;
  MatrixXd gram_, targets_, rest_;
  VectorXd gradient_, offset_;
};

/// Of the targets three by three: all that the reach of a region needs.
struct Blocks {
  double probability;
  VectorXd mean;
  std::vector<Matrix3d> covariance;
};

/// (t − mean)ᵀ Cov⁻¹ (t − mean) below which 95 % of the mixture lie, of one place.
double reach_of(const std::vector<Blocks>& parts, const ConditionedTargets& known, Index place) {
  const auto whole = Matrix3d(known.covariance.block<3, 3>(3 * place, 3 * place)).ldlt();
  const Vector3d middle = known.mean.segment<3>(3 * place);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  std::vector<double> squares;
  double due = 0.5;  // every part gets its share of the draws
  for (const Blocks& part : parts) {
    const Eigen::LLT<Matrix3d> root(part.covariance[static_cast<std::size_t>(place)]);
    for (due += draws_of_mixture * part.probability; due >= 1; --due) {
      Vector3d standard;
      for (double& number : standard) number = normal(generator);
      const Vector3d off = part.mean.segment<3>(3 * place) + root.matrixL() * standard - middle;
      squares.push_back(off.dot(whole.solve(off)));
    }
  }
  return quantile(std::move(squares), 0.95);
}

/// Sums of the moments of a mixture.
struct Moments {
  VectorXd targets, directions;
  MatrixXd of_targets, of_directions, with_directions;

  Moments(Index t, Index z)
      : targets(VectorXd::Zero(t)),
        directions(VectorXd::Zero(z)),
        of_targets(MatrixXd::Zero(t, t)),
        of_directions(MatrixXd::Zero(z, z)),
        with_directions(MatrixXd::Zero(t, z)) {}

  void add(double p, const std::vector<int>& rows, const Posterior& part) {
    targets += p * part.targets;
    of_targets += p * (part.of_targets + part.targets * part.targets.transpose());
    directions(rows) += p * part.directions;
    of_directions(rows, rows) += p * (part.of_directions + part.directions * part.directions.transpose());
    with_directions(Eigen::all, rows) += p * (part.with_directions + part.targets * part.directions.transpose());
  }
};

/// The least probability of a set with a size that counts: the likelier ones hold all but a thousandth.
double least_that_counts(const JointMoves& m) {
  std::vector<double> all;
  for (const DirectionSet& set : m.sets)
    all.insert(all.end(), set.size_probability.begin(), set.size_probability.end());
  std::sort(all.begin(), all.end(), std::greater<>());
  const double whole = std::accumulate(all.begin(), all.end(), 0.0);
  double sum = 0;
  for (const double p : all)
    if ((sum += p) >= most_probability * whole) return p;
  return 0;
}

double sum_from(const JointMoves& m, double least) {
  double sum = 0;
  for (const DirectionSet& set : m.sets)
    for (const double p : set.size_probability)
      if (p >= least) sum += p;
  return sum;
}

}  // namespace

ConditionedTargets condition(const JointMoves& m) {
  Moments sums(m.targets.rows(), m.sd.size());
  ConditionedTargets known;
  std::vector<Blocks> blocks;
  const double least = least_that_counts(m), whole = sum_from(m, least);
  for (Index b = 0; b < m.sizes_mm.size(); ++b) {
    const bool counts = std::any_of(m.sets.begin(), m.sets.end(),
                                    [&](const DirectionSet& set) { return set.size_probability[b] >= least; });
    if (!counts) continue;
    const AtSize at(m, m.sizes_mm[b]);
    for (const DirectionSet& set : m.sets) {
      if (set.size_probability[b] < least) continue;
      const double p = set.size_probability[b] / whole;
      const Posterior part = at.of(set.rows);
      sums.add(p, set.rows, part);
      known.parts.push_back({p, set.rows, part.directions, part.of_directions});
      blocks.push_back({p, part.targets, {}});
      for (Index row = 0; row + 2 < part.targets.size(); row += 3)
        blocks.back().covariance.push_back(part.of_targets.block<3, 3>(row, row));
    }
  }
  known.mean = sums.targets, known.directions_mean = sums.directions;
  known.covariance = sums.of_targets - known.mean * known.mean.transpose();
  known.with_directions = sums.with_directions - known.mean * known.directions_mean.transpose();
  known.directions_covariance = sums.of_directions - known.directions_mean * known.directions_mean.transpose();
  known.reach95.resize(m.targets.rows() / 3);
  for (Index place = 0; place < known.reach95.size(); ++place) known.reach95[place] = reach_of(blocks, known, place);
  return known;
}

MatrixXd covariance_after(const JointMoves& m, double size_mm) {
  JointMoves uncut = m;
  uncut.least.resize(0);
  return AtSize(uncut, size_mm).of(first_rows(uncut.sd.size())).of_targets;
}

namespace {

/// e − μ and its covariance in every set at one size, through the inverse of the covariance of all distances: its block
/// of these rows is the inverse of what the others leave them.
class GivenOthers {
 public:
  GivenOthers(const JointMoves& m, const std::vector<int>& rows, double size) : m_(m) {
    const auto factor = factorised(m.data_errors + size * size * m.data_kernel);
    MatrixXd unit = MatrixXd::Zero(m.y.size(), static_cast<Index>(rows.size()));
    for (std::size_t k = 0; k < rows.size(); ++k) unit(rows[k], static_cast<Index>(k)) = 1;
    const MatrixXd half_unit = factor.matrixL().solve(unit), half_data = factor.matrixL().solve(m.data);
    const VectorXd half_y = factor.matrixL().solve(m.y);
    gram_ = half_data.transpose() * half_data, gradient_ = half_data.transpose() * half_y;
    unit_gram_ = half_unit.transpose() * half_unit, unit_data_ = half_unit.transpose() * half_data;
    unit_y_ = half_unit.transpose() * half_y;
  }

  Expected of(const std::vector<int>& set) const {
    MatrixXd a = gram_(set, set);
    a.diagonal() += m_.sd(set).cwiseAbs2().cwiseInverse();
    const auto root = factorised(a);
    const VectorXd mean = m_.mean(set);
    const MatrixXd columns = unit_data_(Eigen::all, set);
    // Σ_all⁻¹ (y + C m), Σ_all = Σ + C Λ Cᵀ, by Woodbury's formula.
    const VectorXd from_mean = gradient_(set) + gram_(set, set) * mean;
    const MatrixXd inverse = unit_gram_ - columns * root.solve(columns.transpose());
    const VectorXd turned = unit_y_ + columns * mean - columns * root.solve(from_mean);
    const auto block = factorised(inverse);
    return {block.solve(turned), block.solve(MatrixXd::Identity(inverse.rows(), inverse.cols()))};
  }

 private:
  const JointMoves& m_;
  MatrixXd gram_, unit_gram_, unit_data_;
  VectorXd gradient_, unit_y_;
};

double ln_density(const Expected& e) {
  const auto root = factorised(e.covariance);
  return -0.5 * e.less_expected.dot(root.solve(e.less_expected)) - root.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

Expected expected_by_others(const JointMoves& m, const std::vector<int>& rows) {
  std::vector<Expected> parts;
  std::vector<double> ln_probability;
  for (Index b = 0; b < m.sizes_mm.size(); ++b) {
    const GivenOthers given(m, rows, m.sizes_mm[b]);
    for (const DirectionSet& set : m.sets) {
      if (!(set.size_probability[b] > 0)) continue;
      parts.push_back(given.of(set.rows));
      // What these rows said for the set and the size is taken away again.
      ln_probability.push_back(std::log(set.size_probability[b]) - ln_density(parts.back()));
    }
  }
  const double most = *std::max_element(ln_probability.begin(), ln_probability.end());
  const auto n = static_cast<Index>(rows.size());
  VectorXd mean = VectorXd::Zero(n);
  MatrixXd second = MatrixXd::Zero(n, n);
  double whole = 0;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const double p = std::exp(ln_probability[k] - most);
    const Expected& part = parts[k];
    whole += p;
    mean += p * part.less_expected;
    second += p * (part.covariance + part.less_expected * part.less_expected.transpose());
  }
  return {mean / whole, second / whole - mean * mean.transpose() / (whole * whole)};
}

}  // namespace supine::diagnosis
