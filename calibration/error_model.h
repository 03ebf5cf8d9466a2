// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "calibration/residuals.h"

namespace supine::calibration {

/// Points of one pose that lie close to each other, taken as one.
///
/// Scanners smooth: the noise of points 2 mm apart is not independent. Means over small clusters hide that, and lose
/// nothing of what varies slowly over the skin.
struct Clusters {
  /// #C by 3, means of Residuals::on_skin. Scan points lie off the skin by the very distances that are to be explained:
  /// a smooth field over them follows those distances through its slope across the skin.
  Points place;
  Eigen::VectorXi pose;      ///< #C
  Eigen::VectorXi kind;      ///< #C, Residuals::kind
  Eigen::VectorXd members;   ///< #C, points in each
  Eigen::VectorXi of_point;  ///< #R

  /// Means of columns over the points, #C rows.
  Eigen::MatrixXd means(const Eigen::MatrixXd& columns) const;
  /// Whether errors of two may go together: of one pose, both of skin or both along one axis.
  bool related(Eigen::Index a, Eigen::Index b) const { return pose[a] == pose[b] && kind[a] == kind[b]; }
};

/// Clusters of 4 mm radius, or as much larger as it takes to have at most @p most of them; then each row of a landmark
/// by itself. Does not depend on the order of the points.
Clusters cluster_points(const Residuals& residuals, Eigen::Index most);

/// How the errors that are left after a fit go together: noise of single points, and an error of model and mesh that
/// neighbouring points share.
///   Σ_ij = nugget² δ_ij + spread² exp(−|y_i − y_j| / length)   within a pose, 0 between poses
struct ErrorModel {
  /// Of independent points that would average like these: larger than the noise of one point where neighbours share it.
  double nugget_mm = 0;
  double spread_mm = 0;
  double length_mm = 1;

  /// (tr Σ)² / tr(Σ²): how many independent points the scan is worth.
  double effective_count(const Residuals& residuals) const;
};

/// Restricted maximum likelihood (Patterson and Thompson 1971) of the residuals of a fit on a grid of lengths (5 to
/// 60 mm) and spreads, on the means of up to 450 clusters. "Restricted" makes up for what the fitted parameters have
/// absorbed.
/// Does not depend on the order of the points.
/// @param slope  columns ∂d/∂u of what was fitted, #R by #parameters
ErrorModel fit_error_model(const Residuals& residuals, const Eigen::MatrixXd& slope);

/// Aᵀ Σ B for tall A (#R by a) and B (#R by b). Beyond 6000 points the shared part is summed over an even
/// share of them.
Eigen::MatrixXd weighted_product(const ErrorModel& model, const Residuals& residuals, const Eigen::MatrixXd& a,
                                 const Eigen::MatrixXd& b);

/// Rows of the residuals in lexicographic order of place, so that what is drawn from them does not depend on the order
/// of the points.
std::vector<int> order_by_place(const Residuals& residuals);

}  // namespace supine::calibration
