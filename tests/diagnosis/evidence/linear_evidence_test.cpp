// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/linear_evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "common/error.h"
#include "diagnosis/evidence/field_modes.h"

namespace supine::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int count = 40;
constexpr double scale_mm = 0.3, most_mm = 10;

Points places() {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-60, 60);
  Points points(count, 3);
  for (int i = 0; i < count; ++i) points.row(i) << uniform(generator), uniform(generator), 0;
  return points;
}

/// Errors, discrepancy and columns of a made-up measurement.
struct Made {
  Points place = places();
  MatrixXd errors = 0.09 * MatrixXd::Identity(count, count) + 0.04 * gaussian_kernel(place, place, 15);
  MatrixXd kernel = gaussian_kernel(place, place, 25);
  ErrorCovariance covariance{errors, kernel, scale_mm, most_mm};
  Directions all;

  explicit Made(int effects = 3) {
    all.add("modulus", VectorXd::Ones(count), 0.2, 0.5);
    for (int e = 0; e < effects; ++e)
      all.add(
          "effect",
          ((e + 1) * place.col(0) / 25).array().sin().matrix() + ((e + 2) * place.col(1) / 30).array().cos().matrix(),
          0.3, 0.8);
  }
};

VectorXd normals(std::mt19937_64& generator, Eigen::Index size) {
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(size, [&] { return normal(generator); });
}

/// ln of the density of y = -C θ + errors for one size, straight from the covariance of y.
double log_density(const Made& made, const std::vector<int>& which, const VectorXd& y, double size) {
  const MatrixXd c = made.all.columns(Eigen::all, which);
  const VectorXd sd = made.all.sd(which);
  MatrixXd sigma = made.errors + size * size * made.kernel + c * sd.cwiseAbs2().asDiagonal() * c.transpose();
  const Eigen::LLT<MatrixXd> root(sigma);
  const VectorXd off = y + c * made.all.mean(which);
  return -0.5 * off.dot(root.solve(off)) - root.matrixLLT().diagonal().array().log().sum();
}

double log_evidence(const Made& made, const std::vector<int>& which, const VectorXd& y) {
  double sum = 0;
  const VectorXd& sizes = made.covariance.sizes_mm();
  for (Eigen::Index b = 0; b < sizes.size(); ++b)
    sum += made.covariance.size_prior()[b] * std::exp(log_density(made, which, y, sizes[b]));
  return std::log(sum);
}

TEST(LinearEvidence, IsTheDensityOfTheMeasurementOverAllSizesOfTheDiscrepancy) {
  const Made made;
  std::mt19937_64 generator(1);
  const VectorXd y = 0.4 * normals(generator, count) + 0.5 * made.all.columns.col(2);
  const LinearEvidence evidence(made.covariance, y, made.all);
  const double nothing = evidence.weigh({0}).ln_evidence, direct = log_evidence(made, {0}, y);
  for (const std::vector<int>& which : {std::vector{0, 1}, std::vector{0, 2}, std::vector{0, 1, 3}})
    EXPECT_NEAR(evidence.weigh(which).ln_evidence - nothing, log_evidence(made, which, y) - direct, 1e-8);
}

TEST(LinearEvidence, UnderOtherErrorsCountsWhatTheyCouldHaveMade) {
  const Made made;
  Made other;
  other.errors = 3 * made.errors + 0.1 * gaussian_kernel(made.place, made.place, 8);
  other.covariance = ErrorCovariance(other.errors, other.kernel, scale_mm, most_mm);
  std::mt19937_64 generator(8);
  for (const double size_mm : {0.2, 1.5}) {
    const VectorXd y = size_mm * normals(generator, count);
    const double gain = LinearEvidence(other.covariance, y, other.all).weigh({0, 1}).ln_evidence -
                        LinearEvidence(made.covariance, y, made.all).weigh({0}).ln_evidence;
    EXPECT_NEAR(gain, log_evidence(other, {0, 1}, y) - log_evidence(made, {0}, y), 1e-8);
  }
}

TEST(LinearEvidence, PosteriorsAreThoseOfRegression) {
  const Made made;
  std::mt19937_64 generator(2);
  const VectorXd y = normals(generator, count);
  const Weighed weighed = LinearEvidence(made.covariance, y, made.all).weigh({0, 2});
  const MatrixXd c = made.all.columns(Eigen::all, std::vector{0, 2});
  const double s = made.covariance.sizes_mm()[5];
  const MatrixXd inverse = (made.errors + s * s * made.kernel).inverse();
  MatrixXd a = c.transpose() * inverse * c;
  const VectorXd information = made.all.sd(std::vector{0, 2}).cwiseAbs2().cwiseInverse();
  a.diagonal() += information;
  const VectorXd mean =
      a.ldlt().solve(information.cwiseProduct(made.all.mean(std::vector{0, 2})) - c.transpose() * inverse * y);
  EXPECT_LT((weighed.mean[5] - mean).norm(), 1e-9);
  EXPECT_LT((weighed.covariance[5] - a.inverse()).norm(), 1e-9);
  EXPECT_NEAR(weighed.size_probability.sum(), 1, 1e-12);
}

TEST(LinearEvidence, AOneSidedNumberCountsWithTheMassAboveItsLeast) {
  Made made(1);
  made.all.cut_below(0);
  std::mt19937_64 generator(4);
  for (const double size : {-0.4, 0.0, 0.6}) {
    const VectorXd y = 0.3 * normals(generator, count) - size * made.all.columns.col(1);
    const LinearEvidence evidence(made.covariance, y, made.all);
    // Over the number by a sum of 4000 rectangles, the rest by the direct formula.
    double sum = 0, mass = 0;
    constexpr double step = 0.001;
    for (double value = 0.5 * step; value < 4; value += step) {
      const double z = (value - made.all.mean[1]) / made.all.sd[1], prior = std::exp(-0.5 * z * z);
      sum += prior * std::exp(log_evidence(made, {0}, y + value * made.all.columns.col(1)));
      mass += prior;
    }
    const double with = std::log(sum / mass), without = log_evidence(made, {0}, y);
    EXPECT_NEAR(evidence.weigh({0, 1}).ln_evidence - evidence.weigh({0}).ln_evidence, with - without, 2e-3) << size;
  }
}

TEST(LinearEvidence, DrawsOfTheDiscrepancyHaveItsPosteriorMean) {
  const Made made;
  std::mt19937_64 generator(5);
  const VectorXd y = normals(generator, count);
  const LinearEvidence evidence(made.covariance, y, made.all);
  Weighed weighed = evidence.weigh({0});
  constexpr int bin = 6;
  weighed.size_probability = VectorXd::Unit(weighed.size_probability.size(), bin);
  const double s = made.covariance.sizes_mm()[bin];
  const MatrixXd k = s * s * made.kernel, c = made.all.columns.col(0);
  const MatrixXd sigma = made.errors + k + made.all.sd[0] * made.all.sd[0] * c * c.transpose();
  const VectorXd mean = k * sigma.ldlt().solve(y + made.all.mean[0] * c.col(0));
  constexpr int draws = 4000;
  VectorXd sum = VectorXd::Zero(count);
  for (int d = 0; d < draws; ++d) sum += evidence.draw_discrepancy({0}, weighed, generator);
  EXPECT_LT((sum / draws - mean).cwiseAbs().maxCoeff(), 5 * s / std::sqrt(draws));
}

/// Simulation-based calibration (Talts et al. 2018): what is drawn from the priors is found as often as is stated.
TEST(LinearEvidence, StatedProbabilitiesAreTrue) {
  constexpr int effects = 4, draws = 2000, groups = 5;
  const Made made(effects);
  std::mt19937_64 generator(6);
  std::uniform_real_distribution<double> uniform;
  const VectorXd& prior = made.covariance.size_prior();
  std::discrete_distribution<Eigen::Index> size(prior.begin(), prior.end());
  const Eigen::LLT<MatrixXd> errors(made.errors);
  MatrixXd steady = made.kernel;
  steady.diagonal().array() += 1e-10;
  const Eigen::LLT<MatrixXd> kernel(steady);
  std::vector<double> stated(groups, 0), there(groups, 0), number(groups, 0);
  std::vector<int> ranks(10, 0);
  for (int draw = 0; draw < draws; ++draw) {
    const int truth = uniform(generator) < 0.5 ? 0 : 1 + static_cast<int>(uniform(generator) * effects);
    const VectorXd theta = made.all.mean + made.all.sd.cwiseProduct(normals(generator, made.all.size()));
    VectorXd y = errors.matrixL() * normals(generator, count);
    const VectorXd discrepancy = kernel.matrixL() * normals(generator, count);
    y += made.covariance.sizes_mm()[size(generator)] * discrepancy;
    y -= theta[0] * made.all.columns.col(0);
    if (truth > 0) y -= theta[truth] * made.all.columns.col(truth);
    const LinearEvidence evidence(made.covariance, y, made.all);
    VectorXd p(effects + 1);
    for (int h = 0; h <= effects; ++h) {
      const Weighed weighed = evidence.weigh(h == 0 ? std::vector{0} : std::vector{0, h});
      p[h] = weighed.ln_evidence + std::log(h == 0 ? 0.5 : 0.5 / effects);
      if (h != truth || h != 0) continue;
      double below = 0;  // posterior mass below the drawn modulus
      for (std::size_t b = 0; b < weighed.mean.size(); ++b)
        below += weighed.size_probability[static_cast<Eigen::Index>(b)] * 0.5 *
                 std::erfc((weighed.mean[b][0] - theta[0]) / std::sqrt(2 * weighed.covariance[b](0, 0)));
      ++ranks[std::min<std::size_t>(9, static_cast<std::size_t>(10 * below))];
    }
    p = (p.array() - p.maxCoeff()).exp();
    p /= p.sum();
    for (int h = 1; h <= effects; ++h) {
      const auto group = std::min<std::size_t>(groups - 1, static_cast<std::size_t>(p[h] * groups));
      stated[group] += p[h], there[group] += h == truth, number[group] += 1;
    }
  }
  for (int g = 0; g < groups; ++g) {
    const double sd = std::sqrt(std::max(1.0, stated[g] * (1 - stated[g] / number[g])));
    EXPECT_NEAR(there[g], stated[g], 3.3 * sd) << "of " << number[g] << " in group " << g;
  }
  const double nulls = std::accumulate(ranks.begin(), ranks.end(), 0.0);
  double chi_squared = 0;
  for (const int rank : ranks) chi_squared += std::pow(rank - nulls / 10, 2) / (nulls / 10);
  EXPECT_LT(chi_squared, 27.9) << "9 degrees, one in a thousand";
}

TEST(ErrorCovariance, TurnsBackWhatItTurns) {
  const Made made;
  std::mt19937_64 generator(7);
  const VectorXd y = normals(generator, count);
  EXPECT_LT((made.covariance.back(made.covariance.turned(y)) - y).norm(), 1e-9);
  const MatrixXd sigma = made.errors + 4 * made.kernel;
  EXPECT_NEAR(made.covariance.square(y, 2), y.dot(sigma.ldlt().solve(y)), 1e-8);
  EXPECT_NEAR(made.covariance.size_prior().sum(), 1, 1e-12);
}

TEST(ErrorCovariance, RefusesErrorsThatAreNone) {
  const Made made;
  EXPECT_THROW(ErrorCovariance(MatrixXd::Zero(count, count), made.kernel, scale_mm, most_mm), NumericalFailure);
}

}  // namespace
}  // namespace supine::diagnosis
