// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "registration/problem.h"

namespace supine::registration {

/// Where a scan lies, and how well that is known.
struct Fit {
  RigidTransform transform;                    ///< scan → image
  Eigen::Vector3d pivot;                       ///< frame of the image, mm: shifts and turns about it are independent
  Eigen::Matrix<double, 6, 6> covariance;      ///< of Motion about the pivot, after the transform; mm, rad
  double softness = 0, softness_sd = 0;        ///< share by which the body moves further than predicted
  double misfit_mm = 0, misfit_length_mm = 0;  ///< of the body's shape against the prediction, 1 sigma; its length
  double effective_points = 0;                 ///< independent points that would fix the mean as well
  int rows = 0;                                ///< matches and landmark coordinates that counted
};

/// How far from the start a scan is believed to lie beforehand, 1 sigma per axis.
struct Belief {
  double shift_mm = 60, turn_rad = 0.5;
};

/// Generalised least squares of up to 320 matched points (half of them of what is rigid, where so many are) and the
/// landmarks, with Gaussian errors
///   noise²                                          of each point, white, times how many of them say the same, and
///   misfit² (n_i · n_j) κ(|x_i − x_j|/length)       of the body's shape against the prediction, κ Matérn 3/2,
/// an isotropic random displacement field seen along the normals (landmarks: along each axis). What is rigid has the
/// spread rigid_sigma_mm over 40 mm in its place. Misfit and length are not known: the answer is the mean over a grid
/// of both, weighted by the evidence of each (Rasmussen and Williams 2006, eq. 2.30 with explicit basis functions
/// 2.42), and the covariance includes how far the answers differ. No model is believed to be better than 0.8 mm, and
/// the covariance grows by 1 + 6/effective_points, as six numbers were taken from so few. Softness has the prior 0 ±
/// 0.3.
/// @param start  near the answer
Fit fit(const Problem& problem, const RigidTransform& start, const Belief& belief);

/// Fit::covariance for motions about another point of the image's frame.
Eigen::Matrix<double, 6, 6> covariance_about(const Fit& found, const Eigen::Vector3d& point);

/// Whether @p truth (scan → image) lies in the 95 % region of @p found: Mahalanobis distance², to be compared with
/// the 95 % quantile of χ² with 6 degrees of freedom.
double mahalanobis_squared(const Fit& found, const RigidTransform& truth);

}  // namespace supine::registration
