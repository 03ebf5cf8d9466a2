// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/laws/element_sums.h"
#include "simulation/laws/material.h"

namespace supine::simulation {

// Hooke's law in a rotated frame: P = R (2μ ε + λ tr ε), ε = sym(RᵀF) - 1.
//   corotational     R of the polar decomposition F = R U; then P is the derivative of μ‖F-R‖² + λ/2 tr²(RᵀF - 1)
//   corotational_qr  R from the first two edges of the element, as in the study (Nesme et al. 2005): no energy, and the
//                    order of the corners matters

/// Rotation factor of F = R U, det F > 0 (Newton iteration of Higham 1986).
Matrix3 polar_rotation(const Matrix3& f);

/// Undeformed edges X1 - X0 and X2 - X0 of an element.
using Edges = Eigen::Matrix<double, 3, 2>;

/// Orthonormal frame whose first two columns span those of @p edges, by Gram-Schmidt in column order.
Matrix3 frame_of_edges(const Edges& edges);

/// Rotation of corotational_qr: the frame of the deformed edges against that of the undeformed ones.
Matrix3 qr_rotation(const Matrix3& f, const Edges& rest);

/// P for a given R; T = Dual carries the derivative with respect to the material.
template <class T>
Eigen::Matrix<T, 3, 3> corotated_stress(const Matrix3& f, const Matrix3& r, const T& mu, const T& lambda) {
  const Matrix3 s = r.transpose() * f;
  const Matrix3 turned = r * (s + s.transpose()) - 2 * r;
  const double trace = s.trace() - 3;
  Eigen::Matrix<T, 3, 3> p;
  for (int i = 0; i < 9; ++i) p.data()[i] = mu * turned.data()[i] + lambda * (trace * r.data()[i]);
  return p;
}

/// The polar law at one point. Its dilation θ = tr U - 3 is what is averaged over a cell (bulk.h).
struct PolarPoint {
  Matrix3 f, r, u;  ///< F = R U
  double dilation;  ///< θ

  explicit PolarPoint(const Matrix3& deformation);
  double energy(const BulkMaterial<double>& m) const {
    return m.mu_kpa * (f - r).squaredNorm() + 0.5 * m.lambda_kpa * dilation * dilation;
  }
};

/// Adds one quadrature point of weight @p volume. @param pressure  of the cell's mean dilation, kPa: adds P += p R
template <int N>
void add_polar_point(const PolarPoint& point, const BulkMaterial<double>& m, double pressure, const Nodal<N>& gradient,
                     double volume, const Demand& demand, ElementSums<N>& sums);

/// Adds the one point of a linear element, or of N directions in the test of the law; the tangent is not symmetric.
/// @param corner  ∂(undeformed edge c)/∂X_b, #N by 2: 1 for node c + 1, -1 for node 0; only for ∂r/∂X
template <int N>
void add_qr_point(const Matrix3& f, const Edges& rest, const BulkMaterial<double>& m, const Nodal<N>& gradient,
                  double volume, const Eigen::Matrix<double, N, 2>& corner, const Demand& demand, ElementSums<N>& sums);

}  // namespace supine::simulation
