// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/linear_evidence.h"

#include <cmath>
#include <numbers>
#include <numeric>

#include "common/error.h"
#include "common/log_sum.h"

namespace supine::diagnosis {
namespace {

constexpr int bins = 12;
constexpr double finest_mm = 0.1;  // a smaller discrepancy is as good as none

double half_cauchy_below(double x, double scale) { return 2 / std::numbers::pi * std::atan(x / scale); }

double normal_below(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace

SizeBins size_bins(double scale_mm, double most_mm) {
  SizeBins grid{Eigen::VectorXd(bins), Eigen::VectorXd(bins)};
  const double ratio = std::pow(most_mm / finest_mm, 1.0 / (bins - 1));
  double low = 0, high = finest_mm;
  for (int b = 0; b < bins; ++b, low = high, high *= ratio) {
    grid.sizes_mm[b] = b == 0 ? 0.5 * finest_mm : std::sqrt(low * high);
    grid.prior[b] = half_cauchy_below(high, scale_mm) - half_cauchy_below(low, scale_mm);
  }
  grid.prior /= grid.prior.sum();
  return grid;
}

ErrorCovariance::ErrorCovariance(const Eigen::MatrixXd& errors, const Eigen::MatrixXd& kernel, double scale_mm,
                                 double most_mm)
    : factor_(errors), bins_(size_bins(scale_mm, most_mm)) {
  if (factor_.info() != Eigen::Success)
    throw NumericalFailure("the covariance of the scan's errors is not positive; are there points twice in the scan?");
  Eigen::MatrixXd white = factor_.matrixL().solve(kernel);
  white = factor_.matrixL().solve(white.transpose()).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(white);
  vectors_ = eigen.eigenvectors();
  lambda_ = eigen.eigenvalues().cwiseMax(0);
}

Eigen::MatrixXd ErrorCovariance::turned(const Eigen::MatrixXd& columns) const {
  return vectors_.transpose() * factor_.matrixL().solve(columns);
}

Eigen::VectorXd ErrorCovariance::back(const Eigen::VectorXd& turned) const {
  return factor_.matrixL() * (vectors_ * turned);
}

double ErrorCovariance::ln_det() const { return 2 * factor_.matrixLLT().diagonal().array().log().sum(); }

double ErrorCovariance::square(const Eigen::VectorXd& y, double size_mm) const {
  const Eigen::ArrayXd variance = 1 + size_mm * size_mm * lambda_.array();
  return (turned(y).array().square().col(0) / variance).sum();
}

void Directions::add(const std::string& name, const Eigen::VectorXd& column, double prior_mean, double prior_sd,
                     double stands_at, double unit_of_it) {
  names.push_back(name);
  columns.conservativeResize(column.size(), columns.cols() + 1);
  columns.rightCols<1>() = column;
  const Eigen::Index p = columns.cols();
  mean.conservativeResize(p), sd.conservativeResize(p), least.conservativeResize(p);
  stands.conservativeResize(p), unit.conservativeResize(p);
  stands[p - 1] = stands_at, unit[p - 1] = unit_of_it;
  mean[p - 1] = prior_mean, sd[p - 1] = prior_sd, least[p - 1] = 0;
  one_sided.push_back(false);
}

void Directions::cut_below(double value) {
  one_sided.back() = true;
  least[least.size() - 1] = value;
}

std::pair<double, double> Weighed::sum(const Eigen::VectorXd& weights) const {
  double first = 0, second = 0;
  for (std::size_t b = 0; b < mean.size(); ++b) {
    const double p = size_probability[static_cast<Eigen::Index>(b)], here = weights.dot(mean[b]);
    first += p * here;
    second += p * (weights.dot(covariance[b] * weights) + here * here);
  }
  return {first, std::sqrt(std::max(0.0, second - first * first))};
}

std::size_t Weighed::likeliest() const {
  Eigen::Index bin;
  size_probability.maxCoeff(&bin);
  return static_cast<std::size_t>(bin);
}

std::pair<double, double> Weighed::number(Eigen::Index k) const {
  return sum(Eigen::VectorXd::Unit(mean.front().size(), k));
}

std::vector<int> first_rows(Eigen::Index count) {
  std::vector<int> rows(static_cast<std::size_t>(count));
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

LinearEvidence::LinearEvidence(const ErrorCovariance& errors, const Eigen::VectorXd& y, Directions all)
    : errors_(errors),
      all_(std::move(all)),
      distances_(y),
      y_(errors.turned(y)),
      columns_(errors.turned(all_.columns)) {
  for (const double s : errors.sizes_mm()) {
    const Eigen::VectorXd weight = (1 + s * s * errors.lambda().array()).inverse();
    const Eigen::MatrixXd weighted = weight.asDiagonal() * columns_;
    by_size_.push_back({columns_.transpose() * weighted, weighted.transpose() * y_, y_.cwiseAbs2().dot(weight),
                        weight.array().log().sum() - errors.ln_det()});
  }
}

Weighed LinearEvidence::weigh(const std::vector<int>& which) const {
  Weighed result;
  const Eigen::VectorXd m = all_.mean(which), sd = all_.sd(which);
  const Eigen::VectorXd information = sd.cwiseAbs2().cwiseInverse();
  Eigen::VectorXd logs(errors_.sizes_mm().size());
  for (std::size_t b = 0; b < by_size_.size(); ++b) {
    const Products& products = by_size_[b];
    const Eigen::MatrixXd gram = products.gram(which, which);
    const Eigen::VectorXd gradient = products.gradient(which);
    Eigen::MatrixXd a = gram;
    a.diagonal() += information;
    const Eigen::LLT<Eigen::MatrixXd> root(a);
    const Eigen::VectorXd theta = root.solve(information.cwiseProduct(m) - gradient);
    const double f =
        products.square + 2 * gradient.dot(theta) + theta.dot(gram * theta) + information.dot((theta - m).cwiseAbs2());
    double value =
        -0.5 * f + 0.5 * products.log_weight - sd.array().log().sum() - root.matrixLLT().diagonal().array().log().sum();
    const Eigen::MatrixXd covariance = root.solve(Eigen::MatrixXd::Identity(a.rows(), a.cols()));
    for (Eigen::Index k = 0; k < theta.size(); ++k) {
      const auto row = static_cast<std::size_t>(which[static_cast<std::size_t>(k)]);
      if (!all_.one_sided[row]) continue;
      const double least = all_.least[static_cast<Eigen::Index>(row)];
      const double above = normal_below((theta[k] - least) / std::sqrt(covariance(k, k)));
      value += std::log(std::max(above, 1e-300)) - std::log(normal_below((m[k] - least) / sd[k]));
    }
    logs[static_cast<Eigen::Index>(b)] = value + std::log(errors_.size_prior()[static_cast<Eigen::Index>(b)]);
    result.mean.push_back(theta);
    result.covariance.push_back(covariance);
  }
  result.ln_evidence = log_sum(logs);
  result.size_probability = (logs.array() - result.ln_evidence).exp();
  return result;
}

Eigen::VectorXd LinearEvidence::draw_discrepancy(const std::vector<int>& which, const Weighed& weighed,
                                                 std::mt19937_64& generator) const {
  std::normal_distribution<double> normal;
  const auto normals = [&](Eigen::Index count) {
    return Eigen::VectorXd::NullaryExpr(count, [&] { return normal(generator); }).eval();
  };
  std::discrete_distribution<std::size_t> bin(weighed.size_probability.begin(), weighed.size_probability.end());
  const std::size_t b = bin(generator);
  const Eigen::LLT<Eigen::MatrixXd> root(weighed.covariance[b]);
  const Eigen::VectorXd theta = weighed.mean[b] + root.matrixL() * normals(weighed.mean[b].size());
  const Eigen::VectorXd left = y_ + columns_(Eigen::all, which) * theta;
  const double s = errors_.sizes_mm()[static_cast<Eigen::Index>(b)];
  const Eigen::ArrayXd prior = s * s * errors_.lambda().array(), share = prior / (1 + prior);
  return errors_.back(share * left.array() + share.sqrt() * normals(left.size()).array());
}

}  // namespace supine::diagnosis
