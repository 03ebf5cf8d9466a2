// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/score_test.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "calibration/held_out.h"
#include "common/rms.h"
#include "common/statistics.h"

namespace supine::diagnosis {
namespace {

using calibration::Residuals;

constexpr double same_direction = 0.9;
constexpr double implausible = 3;
constexpr int null_draws = 1000;
constexpr double chance = 0.05;

/// A candidate in whitened space, freed of what recalibration can absorb.
struct Projected {
  Eigen::MatrixXd slope;      // M S̃
  Eigen::MatrixXd direction;  // orthonormal
  Eigen::VectorXd secant;     // of length 1; empty where there is none
  double secant_square;       // of the length it had
  double left;                // square of what its stand-in leaves; < 0 where there is none
  bool one_sided;
};

class Scorer {
 public:
  Scorer(const Residuals& residuals, const Eigen::VectorXd& mean_mm, const Eigen::MatrixXd& slope,
         const std::vector<Candidate>& candidates, const Whitening& whitening)
      : residuals_(residuals),
        mean_mm_(mean_mm),
        slope_(slope),
        candidates_(candidates),
        log_points_(std::log(whitening.effective_points())) {
    const Eigen::MatrixXd absorbed = orthonormal_basis(whitening.apply(slope));
    const auto freed = [&absorbed](const Eigen::MatrixXd& a) -> Eigen::MatrixXd {
      return a - absorbed * (absorbed.transpose() * a);
    };
    distance_ = freed(whitening.apply(residuals.distance_mm + mean_mm));
    for (const Candidate& candidate : candidates) {
      Projected p{freed(whitening.apply(candidate.slope)), {}, {}, 0, -1, false};
      if (candidate.stand_in) p.left = freed(whitening.apply(candidate.stand_in->left_mm)).squaredNorm();
      if (candidate.secant.size() > 0) {
        p.secant = freed(whitening.apply(candidate.secant));
        p.secant_square = p.secant.squaredNorm();
        p.secant.normalize();
      }
      p.direction = orthonormal_basis(p.slope);
      p.one_sided = candidate.parameters.size() == 1 && candidate.parameters[0].one_sided;
      projected_.push_back(std::move(p));
    }
    blocks_ = calibration::spatial_blocks(residuals);
  }

  Score score(std::size_t c) const {
    const Candidate& candidate = candidates_[c];
    const Projected& p = projected_[c];
    Score score{};
    score.effect = candidate.effect;
    score.freedom = static_cast<int>(p.direction.cols());
    const auto solver = p.slope.completeOrthogonalDecomposition();
    score.step = -solver.solve(distance_);
    const Eigen::MatrixXd inverse = solver.pseudoInverse();
    score.step_sd = inverse.rowwise().norm();
    for (Eigen::Index k = 0; k < score.step.size(); ++k) {
      const CandidateParameter& parameter = candidate.parameters[static_cast<std::size_t>(k)];
      score.step[k] += parameter.null;
      const double range = score.step[k] > parameter.null ? parameter.upper : parameter.lower;
      score.beyond_range |= std::abs(score.step[k] - parameter.null) > implausible * std::abs(range - parameter.null);
    }
    score.wrong_sign = p.one_sided && score.step[0] < candidate.parameters[0].null;
    score.beyond_range &= !score.wrong_sign;  // a one-sided range has no other side to leave
    score.slope_statistic = statistic_along_slope(p, distance_);
    score.statistic = std::max(score.slope_statistic, statistic_along_secant(p, distance_));
    score.bic = score.statistic - score.freedom * log_points_;
    predict(candidate, score);
    score.noncentrality = expected(candidate, p);
    score.expected_ln_factor = expected_ln_factor(score.noncentrality, score.freedom);
    return score;
  }

  /// b of the best candidate for pure noise.
  std::vector<double> null_maxima(unsigned seed) const {
    std::vector<double> maxima(null_draws);
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    Eigen::VectorXd z(distance_.size());
    for (double& best : maxima) {
      for (double& number : z) number = normal(generator);
      best = -1e300;
      for (const Projected& p : projected_) {
        const double t = std::max(statistic_along_slope(p, z), statistic_along_secant(p, z));
        best = std::max(best, t - static_cast<double>(p.direction.cols()) * log_points_);
      }
    }
    return maxima;
  }

  Eigen::MatrixXd alike() const {
    const auto count = static_cast<Eigen::Index>(projected_.size());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(count, count);
    for (Eigen::Index a = 0; a < count; ++a)
      for (Eigen::Index b = 0; b < a; ++b) matrix(a, b) = matrix(b, a) = correlation(projected_[a], projected_[b]);
    return matrix;
  }

  double held_out_rms(const Eigen::VectorXd& distance, const Eigen::MatrixXd& slope) const {
    Residuals moved = residuals_;
    moved.distance_mm = distance;
    return rms(calibration::held_out_distances(moved, slope, Eigen::VectorXd::Zero(slope.cols()), blocks_));
  }

 private:
  static double correlation(const Projected& a, const Projected& b) {
    const Eigen::MatrixXd product = a.direction.transpose() * b.direction;
    return product.size() == 0 ? 0 : Eigen::JacobiSVD<Eigen::MatrixXd>(product).singularValues()[0];
  }

  static double statistic_along_slope(const Projected& p, const Eigen::VectorXd& d) {
    const bool wrong = p.one_sided && p.slope.col(0).dot(d) > 0;
    return wrong ? 0 : (p.direction.transpose() * d).squaredNorm();
  }

  static double statistic_along_secant(const Projected& p, const Eigen::VectorXd& d) {
    if (p.secant.size() == 0) return 0;
    const double along = -p.secant.dot(d);
    return p.one_sided && along < 0 ? 0 : along * along;
  }

  /// Errors after the joint linear step that a calibration would make (every point counts once), the candidate's part
  /// cut at its bounds.
  void predict(const Candidate& candidate, Score& score) const {
    Eigen::MatrixXd both(slope_.rows(), slope_.cols() + candidate.slope.cols());
    both << slope_, candidate.slope;
    Eigen::VectorXd d = residuals_.distance_mm;
    const Eigen::VectorXd step = -both.completeOrthogonalDecomposition().solve(d + mean_mm_);
    for (Eigen::Index k = 0; k < candidate.slope.cols(); ++k) {
      const CandidateParameter& parameter = candidate.parameters[static_cast<std::size_t>(k)];
      const double wanted = parameter.null + step[slope_.cols() + k];
      d += candidate.slope.col(k) * (std::clamp(wanted, parameter.lower, parameter.upper) - parameter.null);
    }
    d -= slope_ * slope_.completeOrthogonalDecomposition().solve(d);
    score.predicted_rms_mm = rms(d);
    score.predicted_held_out_rms_mm = held_out_rms(d, both);
  }

  /// T at the typical size. Many effects grow slower than their slope at the null: where the catalogue's size was
  /// solved, what it changes counts, and where all else was fitted to make up for it, what that leaves.
  static double expected(const Candidate& candidate, const Projected& p) {
    if (p.left >= 0) return p.left;
    if (p.secant.size() > 0) return p.secant_square;
    double sum = 0;
    for (Eigen::Index k = 0; k < p.slope.cols(); ++k)
      sum += p.slope.col(k).squaredNorm() * std::pow(candidate.parameters[static_cast<std::size_t>(k)].typical, 2);
    return sum / static_cast<double>(p.slope.cols());
  }

  const Residuals& residuals_;
  const Eigen::VectorXd& mean_mm_;
  const Eigen::MatrixXd& slope_;
  const std::vector<Candidate>& candidates_;
  double log_points_;
  Eigen::VectorXd distance_;
  std::vector<Projected> projected_;
  Eigen::VectorXi blocks_;
};

}  // namespace

double expected_ln_factor(double noncentrality, int freedom) {
  const double q = std::max(freedom, 1);
  return 0.5 * (noncentrality - q * std::log1p(noncentrality / q));
}

double size_that_reaches(double ln_factor, double share, double noncentrality, int freedom) {
  if (!(noncentrality > 0)) return std::numeric_limits<double>::infinity();
  const double q = std::max(freedom, 1), width = noncentrality / q;
  const double least = std::max(0.0, (2 * ln_factor + q * std::log1p(width)) * (1 + width) / width);
  double low = 0, high = 1;
  while (chi_squared_power(freedom, high * high, least) < share) high *= 2;
  for (int halving = 0; halving < 50; ++halving) {
    const double middle = 0.5 * (low + high);
    (chi_squared_power(freedom, middle * middle, least) < share ? low : high) = middle;
  }
  return high / std::sqrt(noncentrality);
}

bool settles(double noncentrality, int freedom) {
  return expected_ln_factor(noncentrality, freedom) >= std::log(settling_factor);
}

std::vector<std::string> unsettled(const ScoreTable& table) {
  std::vector<std::string> effects;
  for (const Score& score : table.scores)
    if (!settles(score.noncentrality, score.freedom)) effects.push_back(score.effect);
  return effects;
}

double power_of(const ScoreTable& table, int freedom, double noncentrality) {
  return chi_squared_power(freedom, noncentrality, table.chance_bic + freedom * std::log(table.effective_points));
}

ScoreTable score_candidates(const Residuals& residuals, const Eigen::VectorXd& mean_mm, const Eigen::MatrixXd& slope,
                            const std::vector<Candidate>& candidates, const Whitening& whitening, unsigned seed) {
  const Scorer scorer(residuals, mean_mm, slope, candidates, whitening);
  ScoreTable table;
  table.base_rms_mm = rms(residuals.distance_mm);
  table.base_held_out_rms_mm = scorer.held_out_rms(residuals.distance_mm, slope);
  table.effective_points = whitening.effective_points();
  table.alike = scorer.alike();
  for (const Candidate& candidate : candidates) table.effects.push_back(candidate.effect);
  std::vector<double> maxima = scorer.null_maxima(seed);
  std::sort(maxima.begin(), maxima.end());
  table.chance_bic = maxima[static_cast<std::size_t>((1 - chance) * null_draws)];
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    Score score = scorer.score(c);
    const auto higher = maxima.end() - std::lower_bound(maxima.begin(), maxima.end(), score.bic);
    score.p_value = static_cast<double>(1 + higher) / static_cast<double>(1 + maxima.size());
    score.power = power_of(table, score.freedom, score.noncentrality);
    for (std::size_t other = 0; other < candidates.size(); ++other)
      if (other != c && table.alike(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(other)) > same_direction)
        score.not_told_apart_from.push_back(candidates[other].effect);
    table.scores.push_back(std::move(score));
  }
  std::stable_sort(table.scores.begin(), table.scores.end(),
                   [](const Score& a, const Score& b) { return a.bic > b.bic; });
  return table;
}

}  // namespace supine::diagnosis
