// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Dense>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace supine::diagnosis {

/// A grid of sizes s of a discrepancy, and the prior mass of each of its bins; the first reaches down to 0.
struct SizeBins {
  Eigen::VectorXd sizes_mm, prior;
};
/// Of a half-Cauchy prior. @param scale_mm  of it  @param most_mm  where it ends
SizeBins size_bins(double scale_mm, double most_mm);

/// Errors that stand in every hypothesis, R, and a discrepancy of unknown size s, Σ_s = R + s² K, made diagonal for
/// every s by one generalised eigenproblem K v = λ R v.
class ErrorCovariance {
 public:
  /// @param errors  R, #n by #n, mm²   @param kernel  K, the same, mean diagonal 1
  /// @param scale_mm  of the half-Cauchy prior of s   @param most_mm  where it ends
  /// @throws NumericalFailure  R is not positive
  ErrorCovariance(const Eigen::MatrixXd& errors, const Eigen::MatrixXd& kernel, double scale_mm, double most_mm);

  /// Columns in coordinates whose errors are independent with variances 1 + s² λ_i.
  Eigen::MatrixXd turned(const Eigen::MatrixXd& columns) const;
  /// The way back.
  Eigen::VectorXd back(const Eigen::VectorXd& turned) const;

  const Eigen::VectorXd& lambda() const { return lambda_; }
  double ln_det() const;  ///< of R
  const Eigen::VectorXd& sizes_mm() const { return bins_.sizes_mm; }
  const Eigen::VectorXd& size_prior() const { return bins_.prior; }
  /// yᵀ Σ_s⁻¹ y
  double square(const Eigen::VectorXd& y, double size_mm) const;

 private:
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixXd vectors_;
  Eigen::VectorXd lambda_;
  SizeBins bins_;
};

/// Numbers that distances depend on linearly, with independent normal priors, as offsets from where they stand. What
/// they stand for has the value stands + unit × number.
struct Directions {
  std::vector<std::string> names;
  Eigen::MatrixXd columns;      ///< #n by #p, mm per unit
  Eigen::VectorXd mean, sd;     ///< of the prior
  std::vector<bool> one_sided;  ///< whether values below `least` do not exist
  Eigen::VectorXd least;
  Eigen::VectorXd stands, unit;

  Eigen::Index size() const { return mean.size(); }
  void add(const std::string& name, const Eigen::VectorXd& column, double prior_mean, double prior_sd,
           double stands_at = 0, double unit_of_it = 1);
  /// The last one has no values below @p value.
  void cut_below(double value);
};

/// 0, 1, … up to @p count.
std::vector<int> first_rows(Eigen::Index count);

/// A hypothesis weighed: distances y = −C θ + errors, all normal.
struct Weighed {
  double ln_evidence = 0;                   ///< over s, up to what is the same for all of as many distances
  Eigen::VectorXd size_probability;         ///< posterior of the bins of s
  std::vector<Eigen::VectorXd> mean;        ///< per bin: posterior of the numbers
  std::vector<Eigen::MatrixXd> covariance;  ///< the same

  /// Mean and standard deviation of a weighted sum of the numbers over all bins.
  std::pair<double, double> sum(const Eigen::VectorXd& weights) const;
  /// Of number k.
  std::pair<double, double> number(Eigen::Index k) const;
  /// The likeliest bin of s.
  std::size_t likeliest() const;
};

/// Evidence of subsets of directions for one measurement (linear-Gaussian, so exact; Laplace's formula otherwise):
///   ln p(y | s) = −½ F − ½ ln det Σ_s − ½ ln det Λ − ½ ln det A,   F = min_θ ‖y + C θ‖²_Σ⁻¹ + ‖θ − m‖²_Λ⁻¹,
/// A = CᵀΣ⁻¹C + Λ⁻¹; a one-sided number counts with its posterior mass above its least value over the prior's.
class LinearEvidence {
 public:
  LinearEvidence(const ErrorCovariance& errors, const Eigen::VectorXd& y, Directions all);

  /// @param which  rows of the directions
  Weighed weigh(const std::vector<int>& which) const;
  Weighed weigh_all() const { return weigh(first_rows(all_.size())); }
  /// A draw from the posterior of what neither the numbers nor the errors explain, mm, #n.
  Eigen::VectorXd draw_discrepancy(const std::vector<int>& which, const Weighed& weighed,
                                   std::mt19937_64& generator) const;
  const ErrorCovariance& errors() const { return errors_; }
  const Directions& directions() const { return all_; }
  const Eigen::VectorXd& distances() const { return distances_; }

 private:
  const ErrorCovariance& errors_;
  Directions all_;
  Eigen::VectorXd distances_;
  Eigen::VectorXd y_;        // turned
  Eigen::MatrixXd columns_;  // turned
  struct Products {
    Eigen::MatrixXd gram;
    Eigen::VectorXd gradient;
    double square, log_weight;
  };
  std::vector<Products> by_size_;
};

}  // namespace supine::diagnosis
