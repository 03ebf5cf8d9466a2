// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

namespace supine::meshing {

/// The four cubic B-splines (uniform knots) that do not vanish at a coordinate, with derivatives in 1/mm, 1/mm².
struct SplineWeights {
  int first;  ///< number of the first of the four coefficients
  std::array<double, 4> value, slope, curvature;
};

/// Weights at @p u = (coordinate - origin) / knot, for @p size coefficients; the splines span u in [0, size - 3].
/// Outside, the quadratic Taylor polynomial at the nearer end continues every spline (twice continuously
/// differentiable).
SplineWeights spline_weights(double u, int size, double knot_mm);

/// Gram matrices ∫ B_i^(m) B_j^(m) du of the derivatives m = 0 … 3 over the whole span, knots 1 apart; size by size.
std::array<Eigen::MatrixXd, 4> spline_gram(int size);

}  // namespace supine::meshing
