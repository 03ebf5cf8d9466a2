// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace supine {

/// Value below which the share @p p of @p values lies, linear between neighbouring order statistics: of n sorted
/// values the one at place p (n − 1) (type 7 of Hyndman and Fan 1996). NaN without values.
/// @pre  p in [0, 1]
double quantile(std::vector<double> values, double p);

/// quantile(values, 0.5).
double median(const Eigen::VectorXd& values);

/// z below which a standard normal variable lies with probability @p p. @pre  0 < p < 1
double normal_quantile(double p);

/// z of a two-sided 95 % interval: ± 1.96 standard deviations.
inline double normal_reach95() { return normal_quantile(0.975); }

/// Value below which a χ² of @p freedom degrees lies with probability @p p. @pre  freedom ≥ 1, 0 ≤ p < 1
double chi_squared_quantile(int freedom, double p);

/// Chance that a χ² of @p freedom degrees is above @p value; 1 with fewer than one degree.
double chi_squared_above(int freedom, double value);

/// Chance that a χ² of @p freedom degrees and noncentrality @p lambda is above @p value; 0 with fewer than one degree.
double chi_squared_power(int freedom, double lambda, double value);

/// Orthonormal basis of the column space, #rows by rank; as given where there are no columns.
Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd& columns);

}  // namespace supine
