// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/arrays.h"

namespace supine::diagnosis {

/// Means of the first @p corners nodes of each element, #elements by 3.
Points middles(const Points& points, const Indices& nodes, int corners);

/// Rows that lie as far from each other as they can, from the first on; at most @p most, fewer where points coincide.
std::vector<int> spread_out(const Points& points, int most);

/// exp(−|a − b|² / (2 length²)), #a by #b.
Eigen::MatrixXd gaussian_kernel(const Points& a, const Points& b, double length_mm);

/// Shapes of a random field with covariance exp(−|a − b|² / (2 length²)), largest first, each one standard deviation:
/// its Karhunen–Loève modes, by Nyström's method on up to 300 centres spread over the points; as many as hold 98 % of
/// the variance. What is left out would count as evidence against every smooth cause: 40 modes over 20 mm hold 97 % in
/// a breast of 340 ml, 73 % in one of 1.7 l.
/// @return  #points by at most @p most
Eigen::MatrixXd field_modes(const Points& points, double length_mm, int most = 160);

/// Columns less their projection on @p shape under @p weight (#points).
Eigen::MatrixXd without(const Eigen::VectorXd& shape, const Eigen::VectorXd& weight, Eigen::MatrixXd columns);

}  // namespace supine::diagnosis
