// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace supine::diagnosis {

/// Directions of which all that are named are there and all others are zero, and how likely that is.
struct DirectionSet {
  std::vector<int> rows;             ///< of θ
  Eigen::VectorXd size_probability;  ///< of this set with each size s; over all sets and sizes the sum is 1
};

/// Distances that were measured and places that were not, both moved by the same unknowns, all normal:
///   y + C θ + P a + s D b + ε = 0,   t = T θ + T_P a + s T_D b + e,
/// θ with means and standard deviations, cut where values below some least one do not exist, a and b of one standard
/// deviation each. Which of θ are there at all may be open: a mixture over sets of them. y are the distances as they
/// stand, t the places less those of the model as it stands, mm. Without measurements every matrix of #n has no rows.
struct JointMoves {
  Eigen::VectorXd mean, sd;                      ///< of θ, as offsets from where the model stands, #z
  Eigen::VectorXd least;                         ///< values of θ below do not exist, #z; empty or -infinity: all do
  Eigen::MatrixXd data, targets;                 ///< C (#n by #z) and T (#t by #z)
  Eigen::VectorXd y;                             ///< #n
  Eigen::MatrixXd data_errors;                   ///< of ε and P a together, #n by #n
  Eigen::MatrixXd data_patches, target_patches;  ///< P (#n by #q) and T_P (#t by #q)
  Eigen::MatrixXd data_kernel;                   ///< D Dᵀ, #n by #n
  Eigen::MatrixXd cross_kernel;                  ///< T_D Dᵀ, #t by #n
  Eigen::MatrixXd target_kernel;                 ///< T_D T_Dᵀ, #t by #t
  Eigen::MatrixXd target_errors;                 ///< of e, #t by #t
  Eigen::VectorXd sizes_mm;                      ///< s
  std::vector<DirectionSet> sets;                ///< and how likely each of its values is, with each set
};

/// The posterior of θ in one set at one size; of what is not in the set zero.
struct DirectionsOfSet {
  double probability;
  std::vector<int> rows;
  Eigen::VectorXd mean;        ///< #rows
  Eigen::MatrixXd covariance;  ///< #rows by #rows
};

/// What is known of the targets after the measurement, over all sets and sizes s.
struct ConditionedTargets {
  Eigen::VectorXd mean;             ///< #t, of t
  Eigen::MatrixXd covariance;       ///< #t by #t
  Eigen::VectorXd reach95;          ///< per three rows of t: (t − mean)ᵀ Cov⁻¹ (t − mean) of the 95 % region
  Eigen::MatrixXd with_directions;  ///< covariance of t with θ, #t by #z
  Eigen::VectorXd directions_mean;  ///< of θ, #z
  Eigen::MatrixXd directions_covariance;  ///< of θ, #z by #z
  std::vector<DirectionsOfSet> parts;     ///< those likely enough to count
};

/// Covariance of t at one size s with every direction there and none cut, as it will be after the measurement: no y is
/// needed.
Eigen::MatrixXd covariance_after(const JointMoves& moves, double size_mm);

/// Exact conditioning for every set and s, then the mixture: its mean and covariance, and how far its 95 % reach along
/// that covariance, from draws with a fixed seed. Directions that are cut are so one after the other (Genz and Bretz
/// 2009, ch. 4.1: exact for one).
/// @throws NumericalFailure  the covariance of the distances is not positive
ConditionedTargets condition(const JointMoves& moves);

/// Some of the distances, given the others.
struct Expected {
  Eigen::VectorXd less_expected;  ///< e − μ
  Eigen::MatrixXd covariance;     ///< of it, over all sets and sizes
};
/// Mean and covariance that the others leave them. Sets and sizes are as likely as the others alone make them.
Expected expected_by_others(const JointMoves& moves, const std::vector<int>& rows);

}  // namespace supine::diagnosis
