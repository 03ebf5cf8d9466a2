// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/error_model.h"
#include "calibration/least_squares.h"
#include "common/likelihood.h"

namespace supine::calibration {

/// What a fit is worth, linearised at its optimum.
struct Uncertainty {
  ErrorModel errors;
  double effective_points;      ///< independent points the scan is worth under `errors`
  Eigen::MatrixXd covariance;   ///< of the coordinates u, under correlated errors (sandwich)
  Eigen::MatrixXd never_known;  ///< #u by #K, how far the answer goes when one sigma of a number of judge() holds
  Eigen::MatrixXd white;        ///< the same if every point erred by itself with the residuals' rms: too small
  Eigen::VectorXd singular;     ///< of the slopes over the residuals' rms, descending: 1 / sd of each direction
  /// JᵀJ/τ² and Jᵀ(Σ + N Nᵀ)J/τ⁴ of judge().
  struct Information {
    Eigen::MatrixXd data, spread;
  };
  Information points;
  int rank;  ///< directions that the points determine at all (relative to the largest, 1e-6)
  /// Parameters that move together (|correlation| > 0.95 from the data alone), with their correlation.
  struct Pair {
    std::string first, second;
    double correlation;
  };
  std::vector<Pair> not_told_apart;
};

/// With H = JᵀJ/τ² + P the information of points (rms τ) and priors, and V = Jᵀ(Σ + N Nᵀ)J/τ⁴ + P its true variance:
/// covariance = H⁻¹ V H⁻¹ (Huber, White). Directions the data leave open and no prior closes get a standard deviation
/// of 1e3 coordinates.
/// @param never_known  N, #R by #K mm: what one sigma of each number that is never known and was not fitted does to the
///                     distances, each by itself; without a column the points' own errors are all there is
Uncertainty judge(const Fit& fit, const FreeParameters& parameters, bool use_priors,
                  const Eigen::MatrixXd& never_known = {});

/// What the measurements alone say of each coordinate: its own prior taken out of the estimate and of the spread, those
/// of the others kept. The estimate moves to where the minimised cost lies without that prior, to first order and
/// inside the range: u_i + [(H − P_i)⁻¹]_ii (u_i − m_i) / s_i² with H = Fit::information. The variance is that of
/// judge() without the prior.
/// @param use_priors  as the fit had it; a fit that minimised no cost stays where it is
/// @return per coordinate; none where that is no more than a hundredth of what the range says
std::vector<std::optional<Likelihood>> likelihoods(const Fit& fit, const FreeParameters& parameters,
                                                   const Uncertainty& uncertainty, bool use_priors);

/// An interval of a parameter's value.
struct Interval {
  double low, high;
};

/// value at u ± 1.96 sd, cut at the range.
std::vector<Interval> linear_intervals(const Fit& fit, const FreeParameters& parameters,
                                       const Uncertainty& uncertainty);

/// The interval of one parameter that a profile gave, and the chain runs it took.
struct Profile {
  Interval interval;
  int runs = 0;
};

/// 95 % profile interval of one parameter, which depends on no other's: where twice the cost, minimised over all other
/// parameters, has risen by 3.84 times the parameter's ratio of covariance to white (Chandler and Bate 2007, Pace et
/// al. 2011), both in units of the residuals' rms. Cut at the range. Falls back to the linear end where the chain finds
/// no equilibrium on the way.
Profile profile_interval(Evaluator& evaluator, const FreeParameters& parameters, const FitOptions& options,
                         const Fit& fit, const Uncertainty& uncertainty, Eigen::Index which);

}  // namespace supine::calibration
