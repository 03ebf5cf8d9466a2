// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/uncertainty.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/rms.h"
#include "common/statistics.h"

namespace supine::calibration {
namespace {

constexpr double told_apart = 0.95;
constexpr double open_sd = 1e3;

/// Information with a little added where there is none: along such a direction the variance becomes open_sd².
struct Closed {
  Eigen::MatrixXd inverse, added;

  explicit Closed(const Eigen::MatrixXd& information) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
    const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(1 / (open_sd * open_sd));
    const Eigen::MatrixXd& v = eigen.eigenvectors();
    inverse = v * values.cwiseInverse().asDiagonal() * v.transpose();
    added = v * (values - eigen.eigenvalues()).asDiagonal() * v.transpose();
  }
  Eigen::MatrixXd sandwich(const Eigen::MatrixXd& spread) const { return inverse * (spread + added) * inverse; }
};

Uncertainty::Information points_information(const Fit& fit, const ErrorModel& errors) {
  const Eigen::MatrixXd& j = fit.linearisation.slope;
  const double precision = 1 / mean_square(fit.residuals.distance_mm);
  return {precision * (j.transpose() * j), precision * precision * weighted_product(errors, fit.residuals, j, j)};
}

/// JᵀN/τ².
Eigen::MatrixXd never_known_pull(const Fit& fit, const Eigen::MatrixXd& never_known) {
  const Eigen::MatrixXd& j = fit.linearisation.slope;
  if (never_known.cols() == 0) return Eigen::MatrixXd::Zero(j.cols(), 0);
  return j.transpose() * never_known / mean_square(fit.residuals.distance_mm);
}

/// Of priors and of a user's own residuals, which are normal about what was measured, as priors are.
Eigen::MatrixXd prior_matrix(const Fit& fit, const FreeParameters& parameters, bool use_priors) {
  Eigen::MatrixXd priors = Eigen::MatrixXd::Zero(parameters.size(), parameters.size());
  if (use_priors) priors.diagonal() = parameters.prior_information();
  if (fit.own_information.size() > 0) priors += fit.own_information;
  return priors;
}

/// How far coordinate i goes when its prior no longer holds it.
double without_prior(const Fit& fit, const FreeParameters& parameters, Eigen::Index i) {
  const auto& prior = parameters.priors()[static_cast<std::size_t>(i)];
  if (!prior || fit.information.size() == 0) return fit.u[i];
  const double weight = 1 / (prior->sd * prior->sd);
  Eigen::MatrixXd others = fit.information;
  others(i, i) -= weight;
  const double to = fit.u[i] + Closed(others).inverse(i, i) * weight * (fit.u[i] - prior->mean);
  return std::clamp(to, parameters.lower()[i], parameters.upper()[i]);
}

std::vector<Uncertainty::Pair> twins(const Eigen::MatrixXd& covariance, const FreeParameters& parameters) {
  std::vector<Uncertainty::Pair> pairs;
  const auto& names = parameters.names();
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    for (Eigen::Index j = i + 1; j < covariance.rows(); ++j) {
      const double correlation = covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j));
      if (std::abs(correlation) > told_apart)
        pairs.push_back({names[static_cast<std::size_t>(i)], names[static_cast<std::size_t>(j)], correlation});
    }
  return pairs;
}

}  // namespace

Uncertainty judge(const Fit& fit, const FreeParameters& parameters, bool use_priors,
                  const Eigen::MatrixXd& never_known) {
  const Eigen::MatrixXd& j = fit.linearisation.slope;
  const double tau = rms(fit.residuals.distance_mm);
  Uncertainty result;
  result.errors = fit_error_model(fit.residuals, j);
  result.effective_points = result.errors.effective_count(fit.residuals);
  result.points = points_information(fit, result.errors);
  const Eigen::MatrixXd pull = never_known_pull(fit, never_known);
  result.points.spread += pull * pull.transpose();
  const auto& [data, spread] = result.points;
  const Eigen::MatrixXd priors = prior_matrix(fit, parameters, use_priors);
  const Closed closed(data + priors);
  result.never_known = -closed.inverse * pull;
  result.white = closed.inverse;
  result.covariance = closed.sandwich(spread + priors);
  result.singular = Eigen::JacobiSVD<Eigen::MatrixXd>(j / tau).singularValues();
  result.rank = static_cast<int>((result.singular.array() > 1e-6 * result.singular[0]).count());
  result.not_told_apart = twins(Closed(data).sandwich(spread), parameters);
  return result;
}

std::vector<std::optional<Likelihood>> likelihoods(const Fit& fit, const FreeParameters& parameters,
                                                   const Uncertainty& uncertainty, bool use_priors) {
  const auto& [data, spread] = uncertainty.points;
  std::vector<std::optional<Likelihood>> all;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const auto& prior = parameters.priors()[static_cast<std::size_t>(i)];
    Eigen::MatrixXd others = prior_matrix(fit, parameters, use_priors);
    if (use_priors && prior) others(i, i) -= 1 / (prior->sd * prior->sd);
    const double variance = Closed(data + others).sandwich(spread + others)(i, i);
    const double range = parameters.upper()[i] - parameters.lower()[i];
    if (variance * least_information < range * range)
      all.push_back(Likelihood{use_priors ? without_prior(fit, parameters, i) : fit.u[i], std::sqrt(variance)});
    else
      all.push_back(std::nullopt);
  }
  return all;
}

std::vector<Interval> linear_intervals(const Fit& fit, const FreeParameters& parameters,
                                       const Uncertainty& uncertainty) {
  std::vector<Interval> intervals;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const double reach = normal_reach95() * std::sqrt(uncertainty.covariance(i, i));
    intervals.push_back({parameters.value(i, std::max(fit.u[i] - reach, parameters.lower()[i])),
                         parameters.value(i, std::min(fit.u[i] + reach, parameters.upper()[i]))});
  }
  return intervals;
}

}  // namespace supine::calibration
