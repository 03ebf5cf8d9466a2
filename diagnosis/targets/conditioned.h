// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace supine::diagnosis {

/// Distances that were measured and places that were not, both moved by the same unknowns, all normal:
///   y + C θ + P a + s D b + ε = 0,   t = T θ + T_P a + s T_D b + e,
/// θ with means and standard deviations, a and b of one standard deviation each. y are the distances as they stand, t
/// the places less those of the model as it stands, mm. Without measurements every matrix of #n has no rows.
struct JointMoves {
  Eigen::VectorXd mean, sd;                      ///< of θ, as offsets from where the model stands, #z
  Eigen::MatrixXd data, targets;                 ///< C (#n by #z) and T (#t by #z)
  Eigen::VectorXd y;                             ///< #n
  Eigen::MatrixXd data_errors;                   ///< of ε and P a together, #n by #n
  Eigen::MatrixXd data_patches, target_patches;  ///< P (#n by #q) and T_P (#t by #q)
  Eigen::MatrixXd data_kernel;                   ///< D Dᵀ, #n by #n
  Eigen::MatrixXd cross_kernel;                  ///< T_D Dᵀ, #t by #n
  Eigen::MatrixXd target_kernel;                 ///< T_D T_Dᵀ, #t by #t
  Eigen::MatrixXd target_errors;                 ///< of e, #t by #t
  Eigen::VectorXd sizes_mm, size_probability;    ///< s, and how likely each of its values is
};

/// What is known of the targets after the measurement, over all sizes s.
struct ConditionedTargets {
  Eigen::VectorXd mean;                   ///< #t, of t
  Eigen::MatrixXd covariance;             ///< #t by #t
  Eigen::MatrixXd with_directions;        ///< covariance of t with θ, #t by #z
  Eigen::VectorXd directions_mean;        ///< of θ, #z
  Eigen::MatrixXd directions_covariance;  ///< of θ, #z by #z
};

/// Covariance of t at one size s, as it will be after the measurement: no y is needed.
Eigen::MatrixXd covariance_after(const JointMoves& moves, double size_mm);

/// Exact conditioning for every s, then mean and covariance of the mixture.
/// @throws NumericalFailure  the covariance of the distances is not positive
ConditionedTargets condition(const JointMoves& moves);

/// How unlikely some of the distances are, given the others: (e − μ)ᵀ Σ⁻¹ (e − μ) with the mean and covariance that the
/// others leave them.
struct Surprise {
  Eigen::VectorXd expected_sd_mm;  ///< of each of @p rows
  Eigen::VectorXd less_expected;   ///< e − μ
  Eigen::MatrixXd covariance;      ///< of e − μ
  double square = 0;
  double p_value = 1;  ///< of a χ² with as many degrees as rows
};
Surprise surprise_of(const JointMoves& moves, const std::vector<int>& rows);

}  // namespace supine::diagnosis
